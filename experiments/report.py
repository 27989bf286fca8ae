"""Table 1 as text: for a terminal, and for a recording."""

from collections.abc import Callable, Iterable, Mapping
from functools import partial

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from experiments.table1 import PAPER, Table1
from identify import Array, Estimate

WHY = """\
Chain paper takes the paper's steps; its errors are of the paper's size, not its figures, because the paper gives the
condition numbers of its motion and not the motion. What makes them (switched off one by one in docs/table1.md):
  ZZR1    the 2-point difference loses (w T)^2/6 of a velocity, and again of an acceleration: more, the faster the move.
  Fv, Fs  where a joint turns, the sign of the filtered velocity meets the filtered torque; |qd| of the power model
          has no such jump.
  LMY2    is 24 times smaller than LMX2: what the other columns miss is a larger share of it.
Chain idbench leaves out the prefilter and, on both sides of the model, the instants at which a joint turns, and
differentiates to 6th order."""


def print_table1(console: Console, table: Table1) -> None:
    """Print, for each model, estimates and errors of every chain beside the paper's, Cond(W) and rows."""
    console.print(Text(f"Trajectory {table.scenario.name}: {table.scenario.origin}\n"))
    for form in next(iter(table.estimates.values())):
        console.print(_model_table(table, form))
    if "paper" in table.chains:
        console.print(Text(WHY))


def _model_table(table: Table1, form: str) -> Table:
    """Return a model's table: truth, what the paper prints, and what every chain gives."""
    paper, estimates = PAPER.get(form), [found[form] for found in table.estimates.values()]
    title = f"{form} model" if paper else f"{form} form: the power model over windows (not in the paper's table)"
    grid = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, pad_edge=False)
    grid.add_column("")
    sources = (*(("paper's\nTable 1",) if paper else ()), *(f"chain\n{chain}" for chain in table.chains))
    for heading in ("true\nX", *(f"{source} {what}" for source in sources for what in ("X", "%e"))):
        grid.add_column(heading, justify="right")
    truth = list(table.truth.values())
    for i, (name, true) in enumerate(table.truth.items()):
        printed = (f"{paper.estimate[i]:.3f}", f"{paper.error[i]:.3f}") if paper else ()
        grid.add_row(name, f"{true:g}", *printed, *(cell for e in estimates for cell in _cells(e, truth, i)))
    grid.add_section()
    printed = (f"{paper.condition_number:g}", "") if paper else ()
    grid.add_row("Cond(W)", "", *printed, *(cell for e in estimates for cell in (f"{e.condition_number:.1f}", "")))
    printed = (f"{paper.rows}", "") if paper else ()
    grid.add_row("rows", "", *printed, *(cell for e in estimates for cell in (f"{e.rows}", "")))
    return grid


def _cells(estimate: Estimate, truth: list[float], i: int) -> tuple[str, str]:
    return f"{estimate.X[i]:.5f}", f"{estimate.relative_error_percent(truth)[i]:.2g}"


def markdown(table: Table1) -> str:
    """Return the errors of every form as a markdown table, from the first chain to the last."""
    truth, forms = list(table.truth.values()), list(next(iter(table.estimates.values())))
    found = {form: [estimates[form] for estimates in table.estimates.values()] for form in forms}
    errors = {form: [e.relative_error_percent(truth) for e in found[form]] for form in forms}

    def row(head: str, cells: Callable[[str], Iterable[str]]) -> str:
        return f"| {head} | " + " | ".join(" → ".join(cells(form)) for form in forms) + " |"

    return "\n".join(
        [
            f"Error [%] in chain **{' → '.join(table.chains)}**\n",
            f"| | {' | '.join(forms)} |",
            "|---|" + "---:|" * len(forms),
            *(row(f"{name} {true:g}", partial(_error_cells, errors, i)) for i, (name, true) in enumerate(table.truth.items())),
            row("Cond(W)", lambda form: (f"{e.condition_number:.1f}" for e in found[form])),
            row("rows", lambda form: (f"{e.rows}" for e in found[form])),
        ]
    )


def _error_cells(errors: Mapping[str, list[Array]], i: int, form: str) -> Iterable[str]:
    return (f"{error[i]:.1g}" for error in errors[form])
