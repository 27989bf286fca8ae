"""The answer of a study, in two sentences, computed from its cells."""

from collections.abc import Sequence
from itertools import groupby
from typing import Any

import numpy as np

from experiments.study.statistics import Cell, differences

SURE = 0.01
"""Probability below which two models count as different."""


def answer(cells: Sequence[Cell]) -> str:
    """Return which model errs least where, how clearly, and whether its sigma can be believed."""
    solved = [cell for cell in cells if cell.runs > 1]
    if not solved:
        return f"No run gave an estimate. {failures(cells)}"
    groups = [list(group) for _, group in groupby(solved, key=lambda cell: (tuple(cell.settings.items()), cell.names[:2]))]
    best = [min(group, key=lambda cell: cell.typical) for group in groups]
    return f"{_who(groups, best)} {_sigmas(solved)} {failures(cells)}".strip()


def _who(groups: Sequence[Sequence[Cell]], best: Sequence[Cell]) -> str:
    names = [_not_worse(group, cell) for group, cell in zip(groups, best, strict=True)]
    winners = max(dict.fromkeys(names), key=names.count)
    low, high = min(best, key=lambda c: c.typical), max(best, key=lambda c: c.typical)
    ends = [f"{percent(cell.typical)} ({where(cell)})" for cell in (low, high)]
    span = f"the typical error of the best model goes from {ends[0]} to {ends[1]}"
    if len(groups[0]) == 1:
        return f"With the {best[0].names[2]} model {span}."
    tie = f", with no sure difference between them (p >= {SURE:g})" if len(winners) > 1 else f", surely so (p < {SURE:g})"
    return f"Best in {names.count(winners)} of {len(groups)} combinations: {' and '.join(winners)}{tie}; {span}."


def _not_worse(group: Sequence[Cell], best: Cell) -> tuple[str, ...]:
    """Return the best model of a group, and those that are not surely worse."""
    worse = {d.worse for d in differences(group) if d.better == best.names[2] and d.p < SURE}
    return tuple(cell.names[2] for cell in group if cell.names[2] not in worse)


def _sigmas(cells: Sequence[Cell]) -> str:
    corrected, paper = (
        np.array([c.coverage(getattr(c, which)) for c in cells if c.runs]) for which in ("sigma", "paper_sigma")
    )
    ours, theirs = (f"{100 * x.mean():.0f} % ({100 * x.min():.0f} to {100 * x.max():.0f} %)" for x in (corrected, paper))
    return (
        f"Two corrected sigma hold the truth in {ours} of all cases (lowest to highest of single parameters), two of the "
        f"paper's in {theirs}; 95 % would be right."
    )


def failures(cells: Sequence[Cell]) -> str:
    """Return how many identifications failed; empty if none did."""
    failed = sum(cell.failures.total() for cell in cells)
    every = failed + sum(cell.runs for cell in cells)
    return f"{failed:,} of {every:,} identifications failed; their reasons are listed." if failed else ""


def where(cell: Cell) -> str:
    """Return the settings of a cell in words."""
    settings = ", ".join(f"{name} {value(x)}" for name, x in cell.settings.items())
    return f"{settings}, {cell.names[2]}"


def value(x: Any) -> str:
    """Return the value of an axis as text."""
    return f"{x:.6g}" if isinstance(x, float) else str(x)


def percent(share: float) -> str:
    """Return a share as a percentage of two digits."""
    return f"{100 * share:.0f} %" if share >= 1 else f"{100 * share:.2g} %"
