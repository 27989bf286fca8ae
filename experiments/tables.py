"""Estimates as text."""

from collections.abc import Iterable

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from experiments.identified import Identified
from identify import Estimate


def new_table(title: str, columns: Iterable[str]) -> Table:
    """Return an empty table, its first column of names, the others of numbers."""
    grid = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, pad_edge=False)
    grid.add_column("", no_wrap=True)
    for heading in columns:
        grid.add_column(heading, justify="right", no_wrap=True)
    return grid


def print_identified(console: Console, found: Identified, title: str) -> None:
    """Print truth, if it is known, and of each model estimate, error or sigma, %sigma, Cond(W) and what is explained."""
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
    console.print(Text(f"torque: {channel.meaning}, delay {1e3 * channel.delay:.4g} ms\n"))


def _cells(estimate: Estimate, found: Identified, i: int) -> tuple[str, str, str]:
    if found.truth is None:
        second = estimate.sigma[i]
    else:
        truth = np.array(list(found.truth.values()))
        second = 100 * (estimate.X[i] - truth[i]) / truth[i] if truth[i] else np.nan
    return f"{estimate.X[i]:#.5g}", f"{second:.2g}", f"{estimate.relative_sigma_percent[i]:.2g}"
