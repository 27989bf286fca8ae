"""The report of an identification: one HTML file that needs no other."""

from collections.abc import Iterator, Mapping, Sequence
from importlib.metadata import version
from typing import Any

from experiments.html_report import rendered
from experiments.identification.identified import Identified
from experiments.identification.identify_figures import (
    friction_figure,
    parameters_figure,
    spectra_figure,
    torques_figure,
)
from experiments.identification.validated import Validated
from experiments.identification.verdict import Verdict
from experiments.text import number, percentage
from identify import IdentificationError


def report(
    found: Identified, judged: Sequence[Validated], warnings: Mapping[str, Sequence[str]], notes: Sequence[str], command: str
) -> str:
    """Return the page: whether to trust it, what to see to, torques, parameters, friction, residuals, logs, the command."""
    subject = found.subject
    logs = ", ".join(found.log_names) or "a log"
    cutoff = getattr(found.processing.operator, "cutoff", None)
    return rendered(
        "experiments.identification",
        "identify.html.j2",
        title=f"{subject.tree.name}: {logs}",
        subtitle=f"{subject.tree.n} joints, {len(found.basis.names)} parameters, {found.estimator}",
        verdicts=list(_verdicts(judged[0])),
        unjudged=_why_unjudged(judged[0]),
        failures=found.failures,
        warnings={about: messages for about, messages in warnings.items() if messages},
        unseen=[part for validated in judged for part in _unseen(validated)],
        parameters=parameters_figure(found),
        parameter_heads=[f"{model} {what}" for model in found.estimates for what in ("X", "sigma", "%")],
        parameter_rows=list(_parameters(found)),
        friction=friction_figure(found),
        spectra=spectra_figure(found),
        joints=subject.robot.joints,
        logs=list(_logs(found)),
        notes=notes,
        command=command,
        version=version("idbench"),
        robot=subject.name,
        chain=found.chain,
        cutoff="" if cutoff is None else f"{cutoff:g} Hz",
        estimator=found.estimator,
    )


def _why_unjudged(validated: Validated) -> str:
    try:
        _ = validated.torques
    except IdentificationError as error:
        return str(error)
    return ""


def _verdicts(validated: Validated) -> Iterator[tuple[str, str, str]]:
    if _why_unjudged(validated):
        return
    for model in validated.torques:
        verdict = Verdict(validated, model)
        yield model, verdict.word, "; ".join(verdict.reasons)


def _unseen(validated: Validated) -> Iterator[tuple[str, str, list[str], list[list[str]]]]:
    """Yield title, figure and table of an unseen motion, if it could be judged."""
    if _why_unjudged(validated):
        return
    torques = validated.torques
    heads = ["rms of the torque", *(f"{model} {what}" for model in torques for what in ("rms", "%", "R2"))]
    rows = []
    for j, joint in enumerate(validated.found.subject.robot.joints):
        first = next(iter(torques.values()))
        cells = [cell for v in torques.values() for cell in (f"{v.rms[j]:.3g}", percentage(v.percent[j]), f"{v.R2[j]:.4f}")]
        rows.append([joint, f"{first.level[j]:.3g}", *cells])
    yield validated.title, torques_figure(validated), heads, rows


def _parameters(found: Identified) -> Iterator[list[str]]:
    base = found.subject.base
    for i, (name, unit) in enumerate(zip(found.basis.names, found.basis.units, strict=True)):
        cells = []
        for e in found.estimates.values():
            share = 100 * e.best_sigma[i] / abs(e.X[i]) if e.X[i] else float("inf")
            cells += [number(e.X[i]), f"{e.best_sigma[i]:.2g}", percentage(share)]
        yield [f"{name} [{unit}]", *cells, base.grouping(base.names.index(name)) if base else ""]


def _logs(found: Identified) -> Iterator[list[Any]]:
    errors = next(iter(found.torque_errors.values()), None)
    for k, log in enumerate(found.logs):
        name = found.log_names[k] if found.log_names else "log"
        torque = f"{log.torque.meaning}, delay {1e3 * log.torque.delay:.3g} ms"
        left = [] if errors is None else [f"{x:.2g}" for x in errors[k]]
        yield [name, f"{log.fs:.5g}", f"{log.samples / log.fs:.4g}", torque, *left]
