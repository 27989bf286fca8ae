"""Estimates as text."""

from collections.abc import Iterable, Iterator
from math import isfinite

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from experiments.identified import Identified
from experiments.table2 import PAPER, PAPER_ROWS, REALIZATIONS, Table2
from identify import AsLogged, Estimate

WELL_EXPLAINED = 0.95
"""Share of a torque's variance that a model of the right robot explains on any log that is worth identifying."""


def new_table(title: str, columns: Iterable[str]) -> Table:
    """Return an empty table, its first column of names, the others of numbers."""
    grid = Table(
        title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0)
    )
    grid.add_column("", no_wrap=True)
    for heading in columns:
        grid.add_column(heading, justify="right", no_wrap=True)
    return grid


def print_identified(console: Console, found: Identified, title: str) -> None:
    """Print truth, if it is known, and of each model estimate, error or sigma, %sigma, Cond(W) and what is explained.

    Sigma is the corrected one; the paper's is in the summary.
    """
    known = found.truth is not None
    what = ("X", "%e" if known else "sigma", "%sigma")
    heads = [f"{model}\n{w}" for model in found.estimates for w in what]
    grid = new_table(f"{title}: chain {found.chain}, {found.estimator}", [*(["true\nX"] if known else []), *heads])
    for i, name in enumerate(found.basis.parameters):
        true = [f"{list(found.truth.values())[i]:g}"] if found.truth is not None else []
        grid.add_row(name, *true, *(cell for e in found.estimates.values() for cell in _cells(e, found, i)))
    grid.add_section()
    lead = [""] if known else []
    grid.add_row("Cond(W)", *lead, *(c for e in found.estimates.values() for c in (f"{e.condition_number:.1f}", "", "")))
    grid.add_row("rows", *lead, *(c for e in found.estimates.values() for c in (f"{e.rows}", "", "")))
    for j in range(found.basis.n):
        shares = [f"{100 * share[j]:.3f} %" for share in found.explained.values()]
        grid.add_row(f"tau{j + 1} explained", *lead, *(c for share in shares for c in (share, "", "")))
    console.print(grid)
    channel = found.logs[0].torque
    read = f"{channel.meaning}, delay {1e3 * channel.delay:.4g} ms"
    logged = isinstance(found.processing.alignment, AsLogged)
    console.print(Text(f"torque: {read}" + (f", which chain {found.chain} ignores: it takes it as logged" if logged else "")))
    for doubt in _doubts(found):
        console.print(Text(f"doubtful: {doubt}"))
    console.print()


def _cells(estimate: Estimate, found: Identified, i: int) -> tuple[str, str, str]:
    if found.truth is None:
        second = f"{estimate.corrected_sigma[i]:.2g}"
    else:
        error = float(estimate.error_percent(list(found.truth.values()))[i])
        second = percent(error) if isfinite(error) else ""
    return f"{estimate.X[i]:#.5g}", second, f"{100 * estimate.corrected_sigma[i] / abs(estimate.X[i]):.2g}"


def _doubts(found: Identified) -> Iterator[str]:
    """Yield what no healthy identification shows."""
    for name, estimate in found.estimates.items():
        friction = zip(found.basis.parameters, estimate.X, estimate.corrected_sigma, strict=True)
        negative = [p for p, x, sigma in friction if p.startswith("F") and x < -2 * sigma]
        if negative:
            yield f"{', '.join(negative)} below zero in the {name} model: is the torque's meaning or delay wrong?"
        poor = [f"{100 * share:.0f} % of tau{j + 1}" for j, share in enumerate(found.explained[name]) if share < WELL_EXPLAINED]
        if poor:
            yield f"the {name} model explains {', '.join(poor)}: are units, signs and the torque's delay right?"


def percent(share: float) -> str:
    """Return a signed percentage to two decimals, to none from a hundred on, to one digit below a hundredth."""
    size = abs(share)
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
    grid.add_row("rows", "", f"{PAPER_ROWS}", "", "", *(c for e in estimates.values() for c in (f"{e.rows}", "", "", "")))
    return grid


def _with_sigma(estimate: Estimate, i: int, truth: list[float]) -> tuple[str, str, str, str]:
    return (
        f"{estimate.X[i]:.4f}",
        f"{2 * estimate.sigma[i]:.2g}",
        f"{estimate.relative_sigma_percent[i]:.2g}",
        percent(float(estimate.error_percent(truth)[i])),
    )
