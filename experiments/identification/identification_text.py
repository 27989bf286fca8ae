"""Identifications as text."""

from collections.abc import Iterator, Mapping, Sequence
from math import isfinite, log2, pi

from rich.console import Console
from rich.table import Table
from rich.text import Text

from experiments.identification.consistent_estimate import words_of_consistency
from experiments.identification.identified import Identified
from experiments.identification.iterations import words_of_iterations
from experiments.identification.validated import Validated
from experiments.identification.verdict import SURE, Verdict
from experiments.identification.warnings import FLAGS, doubtful, used
from experiments.text import WORTHLESS, new_table, number, percent, percentage, print_titled
from identify import AsLogged, Estimate, IdentificationError


def print_identified(console: Console, found: Identified, title: str) -> None:
    """Print truth, if it is known, and of each model estimate, error or sigma, %sigma, Cond(W) and what is explained.

    Sigma is the corrected one; the paper's is in the summary.
    """
    marks = doubtful(found)
    flags = used(marks)
    print_titled(
        console, f"{title}: chain {found.chain}, {found.estimator}", _table(found, marks, flags), 1 + (found.truth is not None)
    )
    if flags:
        console.print(Text("; ".join(f"{flag} {FLAGS[flag]}" for flag in flags)))
    for words in _told(found):
        console.print(Text(words), soft_wrap=True)
    if len(found.logs) > 1 and found.torque_errors:
        _print_logs(console, found)
    console.print()


def _table(found: Identified, marks: Mapping[str, Sequence[Sequence[str]]], flags: Sequence[str]) -> Table:
    """Return the table of the parameters, with marks of those that are doubtful, and of the fit as a whole."""
    known, estimates = found.truth is not None, found.estimates
    what = ("X", "%e" if known else "sigma", "%sigma")
    grid = new_table("", [*(["true\nX"] if known else []), *(f"{model}\n{w}" for model in estimates for w in what)])
    for i, name in enumerate(found.basis.names):
        true = [f"{list(found.truth.values())[i]:g}"] if found.truth is not None else []
        each = (_flagged(_cells(e, found, i), marks[m][i] if flags else ("", "", "")) for m, e in estimates.items())
        grid.add_row(name, *true, *(cell for cells in each for cell in cells))
    grid.add_section()
    whole = {
        "Cond(W)": [f"{e.condition_number:.1f}" for e in estimates.values()],
        "rows": [f"{e.row_count}" for e in estimates.values()],
    }
    for j in range(found.basis.n):
        whole[f"tau{j + 1} explained"] = [_explained(share[j]) for share in found.explained.values()]
    for name, cells in whole.items():
        grid.add_row(name, *([""] if known else []), *(cell for first in cells for cell in (first, "", "")))
    return grid


def _told(found: Identified) -> Iterator[str]:
    """Yield what else is to be known: models that failed, torque and delay, noise, rounds, what was moved."""
    for model, why in found.failures.items():
        yield f"{model}: no estimate: {why}"
    channel = found.logs[0].torque
    ignored = f", which chain {found.chain} ignores: it takes it as logged"
    logged = isinstance(found.processing.alignment, AsLogged)
    yield f"torque: {channel.meaning}, delay {1e3 * channel.delay:.4g} ms{ignored if logged else ''}"
    if found.delay is not None:
        delay, sigma = (1e3 * x for x in found.delay)
        words = f"delay found with the parameters: {delay:.4g} ms, sigma {sigma:.2g} ms"
        if abs(delay - 1e3 * channel.delay) > SURE * sigma:
            words += f"; what follows judges them at {1e3 * channel.delay:.4g} ms: give --torque-delay {1e-3 * delay:.4g}"
        yield words
    yield _noise(found)
    yield from words_of_iterations(found)
    if found.consistent != "no" and found.known is None:
        before = {name: e for name, e in found.unconstrained.items() if isinstance(e, Estimate)}
        yield from words_of_consistency(before, found.estimates)


def _print_logs(console: Console, found: Identified) -> None:
    """Print the torque error of the first estimate, log by log."""
    model, errors = next(iter(found.torque_errors.items()))
    grid = new_table("", found.subject.robot.joints)
    for k, name in enumerate(found.log_names or [f"log {k + 1}" for k in range(len(found.logs))]):
        grid.add_row(name, *(f"{x:.2g}" if isfinite(x) else "" for x in errors[k]))
    print_titled(console, f"what the {model} model leaves of each log while joints move: rms torque error [N m, N]", grid)


def _flagged(cells: Sequence[str], marks: Sequence[str]) -> Iterator[str]:
    """Yield cells, each with its mark."""
    return (f"{cell}{mark}" for cell, mark in zip(cells, marks, strict=True))


def _noise(found: Identified) -> str:
    """Return the noise of a log in words, joint by joint."""
    torque, position = (
        " ".join("?" if x is None else f"{x:.2g}" for x in found.noise[name]) for name in ("torque", "position")
    )
    slides = [joint.kind == "slide" for joint in found.subject.tree.joints]
    force, length = ("N m, N", "rad, m") if any(slides) else ("N m", "rad")
    words = f"noise found in the log: torque {torque} {force}, position {position} {length}"
    steps = found.noise["encoder_step"]
    if not any(steps):
        return words
    each = zip(steps, slides, strict=True)
    bits = " ".join("-" if slide else f"{log2(2 * pi / step):.1f}" if step else "?" for step, slide in each)
    return f"{words}; encoder steps {' '.join(f'{x:.3g}' if x else '?' for x in steps)} {length} ({bits} bits)"


def _explained(share: float) -> str:
    return f"{100 * share:.3f} %" if share > -WORTHLESS / 100 else f"<-{WORTHLESS:g} %"


def _cells(estimate: Estimate, found: Identified, i: int) -> tuple[str, str, str]:
    if found.truth is None:
        second = f"{estimate.best_sigma[i]:.2g}"
    else:
        error = float(estimate.error_percent(list(found.truth.values()))[i])
        second = percent(error) if isfinite(error) else ""
    share = 100 * estimate.best_sigma[i] / abs(estimate.X[i]) if estimate.X[i] else float("inf")
    return number(estimate.X[i]), second, percentage(share) or f">{WORTHLESS:g}"


def print_validated(console: Console, validated: Validated) -> None:
    """Print how well torques of a held-out motion are predicted, what the simulated robot does on it, and verdicts."""
    try:
        torques = validated.torques
    except IdentificationError as error:
        if validated.second is not None:
            raise
        console.print(Text(f"not validated on {validated.title}: {error}\n"), soft_wrap=True)
        return
    simulated = any(validated.position_error(model) is not None for model in torques)
    heads = [f"{model}\n{what}" for model in torques for what in ("rms", "%", "R2", "q rms")[: 3 + simulated]]
    grid, first = new_table("", ["noise of\nthe log %", *heads]), next(iter(torques.values()))
    for j, joint in enumerate(validated.found.subject.robot.joints):
        noise = percentage(first.percent_of_level(first.noise)[j])
        cells = (cell for model in torques for cell in _validation_cells(validated, model, j)[: 3 + simulated])
        grid.add_row(joint, noise, *cells)
    what = "torque error while moving [N m, N]" + (", position error of the simulated robot [rad, m]" if simulated else "")
    print_titled(console, f"{validated.title}: {what}", grid, 2)
    still = first.standing
    joints = validated.found.subject.robot.joints
    apart = [f"{joint} {rms:.2g}" for joint, rms in zip(joints, still, strict=True) if isfinite(rms)]
    if apart:
        console.print(Text(f"standing and turning, where friction is not determined: {', '.join(apart)} N m"), soft_wrap=True)
    unsimulated = dict[str, list[str]]()
    for model in torques:
        verdict = Verdict(validated, model)
        console.print(Text(f"{model}: {verdict.word}: {'; '.join(verdict.reasons)}"), soft_wrap=True)
        if verdict.unsimulated:
            unsimulated.setdefault(verdict.unsimulated, []).append(model)
    for why, models in unsimulated.items():
        console.print(Text(f"{', '.join(models)}: not simulated: {why}"), soft_wrap=True)
    for model, why in validated.judged.failures.items():
        console.print(Text(f"{model}: not judged: {why}"), soft_wrap=True)
    console.print()


def _validation_cells(validated: Validated, model: str, j: int) -> tuple[str, str, str, str]:
    validation, off = validated.torques[model], validated.position_error(model)
    R2 = f"{validation.R2[j]:.5f}" if validation.R2[j] > -WORTHLESS else f"<-{WORTHLESS:g}"
    return f"{validation.rms[j]:.2g}", percentage(validation.percent[j]), R2, "" if off is None else f"{off[j]:.1e}"
