"""The report of an identification: one HTML file that needs no other."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from importlib.metadata import version
from typing import Any, TypeVar

from idbench.experiments.identification.fit import Fit
from idbench.experiments.judgement.held_out import HeldOut
from idbench.experiments.judgement.judgement import Judgement, Unjudged
from idbench.experiments.reports.estimates import EstimatesTable
from idbench.experiments.reports.figures import (
    causes_figure,
    friction_figure,
    parameters_figure,
    rendered,
    residuals_figure,
    spectra_figure,
    torques_figure,
)
from idbench.experiments.results.attempts import Attempts
from idbench.experiments.text import percentage

T = TypeVar("T")


def report(
    judgement: Judgement, warnings: Mapping[str, Sequence[str]], notes: Sequence[str], command: str, attempts: Attempts
) -> str:
    """Return the page: whether to trust it, what to check, torques, parameters, friction, residuals, logs, the command.

    A figure that fails is noted in `attempts`, and missing.
    """
    fit, hardest = judgement.fit, judgement.hardest
    table = EstimatesTable(fit)
    robot_model = fit.robot_model
    cutoff = getattr(fit.processing.operator, "cutoff", None)
    return rendered(
        "idbench.experiments.reports",
        "identify.html.j2",
        title=f"{robot_model.tree.name}: {fit.logs.title}",
        subtitle=f"{robot_model.tree.n} joints, {len(fit.basis.names)} parameters, {fit.request.estimator}",
        verdicts=[] if hardest is None else list(_verdicts(hardest)),
        unjudged="; ".join(one.why for one in judgement.on if isinstance(one, Unjudged)),
        failures=fit.failures,
        warnings={about: messages for about, messages in warnings.items() if messages},
        causes=_figure(attempts, "causes", causes_figure, fit),
        unseen=[_held_out(one, attempts) for one in judgement.held_out],
        parameters=_figure(attempts, "parameters", parameters_figure, fit),
        parameter_heads=[" ".join(head) for head in table.heads],
        parameter_rows=list(_parameters(fit, table)),
        legend=table.legend,
        friction=_figure(attempts, "friction", friction_figure, fit),
        spectra=_figure(attempts, "spectra", spectra_figure, fit),
        joints=robot_model.robot.joints,
        logs=list(_logs(fit)),
        notes=notes,
        command=command,
        version=version("idbench"),
        robot=robot_model.name,
        chain=fit.request.chain,
        cutoff="" if cutoff is None else f"{cutoff:g} Hz",
        estimator=fit.request.estimator,
    )


def _figure(attempts: Attempts, name: str, draw: Callable[[T], str], shown: T) -> str:
    """Return a figure, or nothing if it fails."""
    return attempts.attempt(f"the figure of {name} in report.html", lambda: draw(shown)) or ""


def _verdicts(one: HeldOut) -> Iterator[tuple[str, str, str]]:
    alike: dict[tuple[str, str], list[str]] = {}
    for model, verdict in one.verdicts.items():
        alike.setdefault((verdict.word, "; ".join(verdict.reasons)), []).append(model)
    for (word, reasons), models in alike.items():
        yield f"{' and '.join(models)} model{'s' if len(models) > 1 else ''}", word, reasons


def _held_out(one: HeldOut, attempts: Attempts) -> tuple[str, str, str, list[str], list[list[str]]]:
    """Return title, figures of torques and residuals, and table of a held-out log."""
    torques = one.torques
    heads = ["rms of the torque", *(f"{model} {what}" for model in torques for what in ("rms", "%", "R2"))]
    rows = []
    for j, joint in enumerate(one.fit.robot_model.robot.joints):
        first = next(iter(torques.values()))
        cells = [cell for v in torques.values() for cell in (f"{v.rms[j]:.3g}", percentage(v.percent[j]), f"{v.R2[j]:.4f}")]
        rows.append([joint, f"{first.level[j]:.3g}", *cells])
    figures = _figure(attempts, "torques", torques_figure, one), _figure(attempts, "residuals", residuals_figure, one)
    return one.title, *figures, heads, rows


def _parameters(fit: Fit, table: EstimatesTable) -> Iterator[list[str]]:
    made = fit.robot_model.grouping.groupings
    units = dict(zip(fit.basis.names, fit.basis.units, strict=True))
    for name, *cells in table.rows():
        yield [f"{name} [{units[name]}]", *cells, made[name]]


def _logs(fit: Fit) -> Iterator[list[Any]]:
    errors = next(iter(fit.torque_errors.values()), None)
    for k, log in enumerate(fit.logs.fitted):
        name = fit.logs.name(k)
        torque = f"{log.torque.meaning}, delay {log.torque.late}"
        left = [] if errors is None else [f"{x:.2g}" for x in errors[k]]
        yield [name, f"{log.fs:.5g}", f"{log.samples / log.fs:.4g}", torque, *left]
