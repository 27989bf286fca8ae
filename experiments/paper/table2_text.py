"""Table 2 and its twin as text."""

from rich.console import Console
from rich.table import Table
from rich.text import Text

from idbench.experiments.paper.table2 import PAPER, PAPER_ROWS, REALIZATIONS, Table2
from idbench.experiments.text import new_table, percent, print_table
from idbench.identify import Estimate


def print_table2(console: Console, table: Table2) -> None:
    """Print the paper's Table 2 beside its twin, processed twice, and what each imperfection does alone."""
    console.print(Text(f"Scenario {table.scenario.name}: {table.scenario.origin}\n"))
    for model in REALIZATIONS:
        print_table(console, _twin(table, model), 2)
    console.print(
        Text("2s: 2 sigma, %s: %sigma, %e: error. Processed as in the paper (chain paper, OLS), and by chain idbench, WLS.\n")
    )
    console.print(Text("What each imperfection does alone, chain idbench: error of each parameter [%]\n"))
    for form in next(iter(table.attribution.values())):
        grid = new_table(f"{form} model", table.truth)
        for name, errors in table.attribution.items():
            grid.add_row(name, *(percent(error) for error in errors[form]))
        print_table(console, grid)


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
        f"{2 * estimate.own_sigma[i]:.2g}",
        f"{estimate.paper_sigma_percent[i]:.2g}",
        percent(float(estimate.error_percent(truth)[i])),
    )
