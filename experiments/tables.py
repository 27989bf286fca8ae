"""Estimates as text."""

from collections.abc import Iterable
from math import isfinite

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from experiments.identified import Identified
from experiments.table2 import PAPER, PAPER_ROWS, REALIZATIONS, Table2
from experiments.validation import Validated
from experiments.verdict import Verdict
from identify import AsLogged, Estimate, IdentificationError

WORTHLESS = 999.0
"""Percentages from here on all say the same."""


def new_table(title: str, columns: Iterable[str]) -> Table:
    """Return an empty table, its first column of names, the others of numbers."""
    grid = Table(
        title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0)
    )
    grid.add_column("", no_wrap=True)
    for heading in columns:
        grid.add_column(heading, justify="right", no_wrap=True)
    return grid


def print_titled(console: Console, title: str, grid: Table) -> None:
    """Print a table below a title that may be wider than it."""
    console.print(Text(title, style="bold"), soft_wrap=True)
    console.print(grid)


def print_identified(console: Console, found: Identified, title: str) -> None:
    """Print truth, if it is known, and of each model estimate, error or sigma, %sigma, Cond(W) and what is explained.

    Sigma is the corrected one; the paper's is in the summary.
    """
    known = found.truth is not None
    what = ("X", "%e" if known else "sigma", "%sigma")
    heads = [f"{model}\n{w}" for model in found.estimates for w in what]
    grid = new_table("", [*(["true\nX"] if known else []), *heads])
    for i, name in enumerate(found.basis.names):
        true = [f"{list(found.truth.values())[i]:g}"] if found.truth is not None else []
        grid.add_row(name, *true, *(cell for e in found.estimates.values() for cell in _cells(e, found, i)))
    grid.add_section()
    lead = [""] if known else []
    grid.add_row("Cond(W)", *lead, *(c for e in found.estimates.values() for c in (f"{e.condition_number:.1f}", "", "")))
    grid.add_row("rows", *lead, *(c for e in found.estimates.values() for c in (f"{e.row_count}", "", "")))
    for j in range(found.basis.n):
        shares = [_explained(share[j]) for share in found.explained.values()]
        grid.add_row(f"tau{j + 1} explained", *lead, *(c for share in shares for c in (share, "", "")))
    print_titled(console, f"{title}: chain {found.chain}, {found.estimator}", grid)
    channel = found.logs[0].torque
    read = f"{channel.meaning}, delay {1e3 * channel.delay:.4g} ms"
    logged = isinstance(found.processing.alignment, AsLogged)
    for model, why in found.failures.items():
        console.print(Text(f"{model}: no estimate: {why}"), soft_wrap=True)
    console.print(Text(f"torque: {read}" + (f", which chain {found.chain} ignores: it takes it as logged" if logged else "")))
    console.print()


def _explained(share: float) -> str:
    return f"{100 * share:.3f} %" if share > -WORTHLESS / 100 else f"<-{WORTHLESS:g} %"


def _cells(estimate: Estimate, found: Identified, i: int) -> tuple[str, str, str]:
    if found.truth is None:
        second = f"{estimate.best_sigma[i]:.2g}"
    else:
        error = float(estimate.error_percent(list(found.truth.values()))[i])
        second = percent(error) if isfinite(error) else ""
    share = 100 * estimate.best_sigma[i] / abs(estimate.X[i]) if estimate.X[i] else float("inf")
    return number(estimate.X[i]), second, _percentage(share) or f">{WORTHLESS:g}"


def number(x: float) -> str:
    """Return a number to five digits, a small one to three."""
    return f"{x:#.5g}" if abs(x) >= 1e-3 or x == 0 else f"{x:.2e}"


def print_validated(console: Console, validated: Validated) -> None:
    """Print how well torques of an unseen motion are predicted, what the simulated robot does on it, and verdicts."""
    try:
        torques = validated.torques
    except IdentificationError as error:
        if validated.second is not None:
            raise
        console.print(Text(f"not validated on {validated.title}: {error}\n"), soft_wrap=True)
        return
    heads = [f"{model}\n{what}" for model in torques for what in ("rms", "%", "R2", "q rms")]
    grid, first = new_table("", ["noise of\nthe log %", *heads]), next(iter(torques.values()))
    for j, joint in enumerate(validated.found.subject.robot.joints):
        noise = _percentage(first.percent_of_level(first.noise)[j])
        grid.add_row(joint, noise, *(cell for model in torques for cell in _validation_cells(validated, model, j)))
    print_titled(
        console, f"{validated.title}: torque error while moving [N m, N], position error of the simulated robot [rad, m]", grid
    )
    still = first.standing
    joints = validated.found.subject.robot.joints
    apart = [f"{joint} {rms:.2g}" for joint, rms in zip(joints, still, strict=True) if isfinite(rms)]
    if apart:
        console.print(Text(f"standing and turning, where friction is not determined: {', '.join(apart)} N m"), soft_wrap=True)
    for model in torques:
        verdict = Verdict(validated, model)
        console.print(Text(f"{model}: {verdict.word}: {'; '.join(verdict.reasons)}"), soft_wrap=True)
    for model, why in validated.judged.failures.items():
        console.print(Text(f"{model}: not judged: {why}"), soft_wrap=True)
    console.print()


def _validation_cells(validated: Validated, model: str, j: int) -> tuple[str, str, str, str]:
    told, off = validated.torques[model], validated.position_error(model)
    R2 = f"{told.R2[j]:.5f}" if told.R2[j] > -WORTHLESS else f"<-{WORTHLESS:g}"
    return f"{told.rms[j]:.2g}", _percentage(told.percent[j]), R2, "" if off is None else f"{off[j]:.1e}"


def _percentage(x: float) -> str:
    return f"{x:.2g}" if x < WORTHLESS else f">{WORTHLESS:g}" if x >= WORTHLESS else ""


def percent(share: float) -> str:
    """Return a signed percentage to two decimals, to none from a hundred on, to one digit below a hundredth."""
    size = abs(share)
    if size >= WORTHLESS:
        return f"{'-' if share < 0 else ''}>{WORTHLESS:g}"
    return f"{share:+.0f}" if size >= 100 else f"{share:+.2f}" if size >= 0.01 else f"{share:+.0e}" if size else "0"


def print_table2(console: Console, table: Table2) -> None:
    """Print the paper's Table 2 beside its twin, processed twice, and what each imperfection does alone."""
    console.print(Text(f"Scenario {table.scenario.name}: {table.scenario.origin}\n"))
    for model in REALIZATIONS:
        console.print(_twin(table, model))
    console.print(
        Text("2s: 2 sigma, %s: %sigma, %e: error. Processed as in the paper (chain paper, OLS), and by chain idbench, WLS.\n")
    )
    console.print(Text("What each imperfection does alone, chain idbench: error of each parameter [%]\n"))
    for form in next(iter(table.attribution.values())):
        grid = new_table(f"{form} model", table.truth)
        for name, errors in table.attribution.items():
            grid.add_row(name, *(percent(error) for error in errors[form]))
        console.print(grid)


def _twin(table: Table2, model: str) -> Table:
    paper, found = PAPER[model], {name: each[model] for name, each in table.found.items()}
    estimates = {name: one.estimates[model] for name, one in found.items()}
    heads = [f"{name}\n{what}" for name in found for what in ("X", "2s", "%s", "%e")]
    columns = ["true\nX", *(f"Table 2\n{what}" for what in ("X", "2s", "%s")), *heads]
    grid = new_table(f"{model} model, {REALIZATIONS[model]} realizations", columns)
    for i, (name, true) in enumerate(table.truth.items()):
        printed = f"{paper.estimate[i]:g}", f"{paper.two_sigma[i]:g}", f"{paper.relative_sigma_percent[i]:g}"
        cells = [c for e in estimates.values() for c in _with_sigma(e, i, list(table.truth.values()))]
        grid.add_row(name, f"{true:g}", *printed, *cells)
    grid.add_section()
    conds = [c for e in estimates.values() for c in (f"{e.condition_number:.0f}", "", "", "")]
    grid.add_row("Cond(W)", "", f"{paper.condition_number:g}", "", "", *conds)
    grid.add_row("rows", "", f"{PAPER_ROWS}", "", "", *(c for e in estimates.values() for c in (f"{e.row_count}", "", "", "")))
    return grid


def _with_sigma(estimate: Estimate, i: int, truth: list[float]) -> tuple[str, str, str, str]:
    return (
        f"{estimate.X[i]:.4f}",
        f"{2 * estimate.sigma[i]:.2g}",
        f"{estimate.relative_sigma_percent[i]:.2g}",
        percent(float(estimate.error_percent(truth)[i])),
    )
