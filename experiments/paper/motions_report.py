"""The errors of Table 1 over random motions, as text and as a picture."""

from io import BytesIO

import numpy as np
from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table
from rich.text import Text

from idbench.experiments.paper.motions import BAND, COMPARED, Errors, Table1Motions
from idbench.experiments.paper.table1 import PAPER
from idbench.experiments.text import new_table, print_titled

FEW = 40  # Motions below which less than two lie outside of either end of the band

COLORS = {"paper": "#b5651d", "paper_masked": "#2f6f9f"}

NAMES = {"paper": "the paper's steps", "paper_masked": "the same, reversals left out"}


def print_motions(console: Console, found: Table1Motions) -> None:
    """Print the paper's errors beside the median and the band of each chain, and how many they explain."""
    for model in PAPER:
        print_titled(console, f"{model} model: errors [%]; a star where the paper's lies inside the band", _table(found, model))
    for chain in COMPARED:
        console.print(Text(_said(found, chain)), soft_wrap=True)


def _table(found: Table1Motions, model: str) -> Table:
    heads = [f"{chain}\n{what}" for chain in COMPARED for what in ("median", f"{BAND[0]:g} to {BAND[1]:g} %", "")]
    grid = new_table("", ["paper's\n%e", *heads])
    for i, name in enumerate(found.truth):
        cells = [cell for chain in COMPARED for cell in _cells(found.errors[chain], model, i)]
        grid.add_row(name, f"{PAPER[model].error[i]:.3f}", *cells)
    grid.add_section()
    conditions = (f"{np.median(found.errors[chain].condition[model]):.0f}" for chain in COMPARED)
    grid.add_row("Cond(W)", f"{PAPER[model].condition_number:g}", *(cell for c in conditions for cell in (c, "", "")))
    return grid


def _cells(errors: Errors, model: str, i: int) -> tuple[str, str, str]:
    low, middle, high = (errors.percentiles(model, q)[i] for q in (BAND[0], 50, BAND[1]))
    return f"{middle:.2g}", f"{low:.1g} to {high:.2g}", "*" if errors.explained(model)[i] else ""


def _said(found: Table1Motions, chain: str) -> str:
    errors = found.errors[chain]
    inside = sum(int(np.count_nonzero(errors.explained(model))) for model in PAPER)
    cells = len(PAPER) * len(found.truth)
    friction = _times(found, chain, "F")
    few = f"; so few motions make no band, draw more than {found.motions}" if errors.kept < FEW else ""
    return (
        f"{NAMES[chain]} (chain {chain}): {errors.kept} of {errors.drawn} motions have the paper's Cond(W) within "
        f"{found.tolerance:.0%}; {inside} of {cells} of the paper's errors lie inside the band; the friction errors of the "
        f"explicit model are {friction:.2g} times the paper's (geometric mean of the medians){few}"
    )


def _times(found: Table1Motions, chain: str, letters: str) -> float:
    """Return the median errors of some of the explicit model's parameters over the paper's, as a geometric mean."""
    which = [i for i, name in enumerate(found.truth) if name.startswith(letters)]
    median = found.errors[chain].percentiles("explicit", 50)[which]
    return float(np.exp(np.mean(np.log(median / np.array(PAPER["explicit"].error)[which]))))


def picture(found: Table1Motions) -> bytes:
    """Return the medians and bands of every error beside the paper's, as a PNG."""
    figure = Figure(figsize=(12, 4.6), layout="constrained")
    axes = figure.subplots(1, len(PAPER), sharey=True)
    for panel, model in zip(axes, PAPER, strict=True):
        at = np.arange(len(found.truth))
        for k, chain in enumerate(COMPARED):
            low, middle, high = (found.errors[chain].percentiles(model, q) for q in (BAND[0], 50, BAND[1]))
            x = at + 0.24 * (k - 0.5)
            panel.vlines(x, low, high, color=COLORS[chain], linewidth=5, alpha=0.45)
            panel.plot(x, middle, "o", color=COLORS[chain], markersize=4, label=NAMES[chain])
        panel.plot(at, PAPER[model].error, "kx", markersize=7, markeredgewidth=1.8, label="the paper")
        panel.set_yscale("log")
        panel.set_ylim(5e-4, 50)
        panel.set_xticks(at, list(found.truth))
        panel.set_title(f"{model} model", loc="left", fontsize=11)
        panel.grid(axis="y", color="0.9")
        panel.spines[["top", "right"]].set_visible(False)
    axes[0].set_ylabel(f"error [%]: median, and {BAND[0]:g} to {BAND[1]:g} % of the motions")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper left", ncols=3, frameon=False)
    file = BytesIO()
    figure.savefig(file, format="png", dpi=110)
    return file.getvalue()
