"""The answer of a study, in two sentences, computed from its cells."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from experiments.study.statistics import Cell, differences

SURE = 0.01
"""Probability below which two ways of identification count as different."""


def answer(cells: Sequence[Cell]) -> str:
    """Return which model, in which chain, errs least and how clearly, and whether its sigma can be believed."""
    solved = [cell for cell in cells if cell.runs > 1]
    if not solved:
        return f"No run gave an estimate. {failures(cells)}"
    return f"{_who(solved)} {_sigmas(solved)} {failures(cells)}".strip()


def _who(cells: Sequence[Cell]) -> str:
    groups: dict[str, list[Cell]] = {}
    for cell in cells:
        groups.setdefault(combination(cell), []).append(cell)
    best = [min(group, key=lambda cell: cell.typical) for group in groups.values()]
    names = [_not_worse(group, cell, cells) for group, cell in zip(groups.values(), best, strict=True)]
    winners = max(dict.fromkeys(names), key=names.count)
    low, high = min(best, key=lambda c: c.typical), max(best, key=lambda c: c.typical)
    ends = [f"{percent(cell.typical)} ({combination(cell)})" for cell in (low, high)]
    span = (
        f"the typical error of the best goes from {ends[0]} to {ends[1]}"
        if len(best) > 1
        else f"its typical error is {ends[0]}"
    )
    if len(cells) == len(groups):
        return f"With the {method(best[0], cells)} {span}."
    tie = f", with no sure difference between them (p >= {SURE:g})" if len(winners) > 1 else f", surely so (p < {SURE:g})"
    return f"Best in {names.count(winners)} of {len(groups)} combinations: {' and '.join(winners)}{tie}; {span}."


def _not_worse(group: Sequence[Cell], best: Cell, cells: Sequence[Cell]) -> tuple[str, ...]:
    """Return the best cell of a group, and those that are not surely worse."""
    worse = {id(d.worse) for d in differences(group) if d.better is best and d.p < SURE}
    return tuple(method(cell, cells) for cell in group if id(cell) not in worse)


def _sigmas(cells: Sequence[Cell]) -> str:
    chains = list(dict.fromkeys(cell.names[0] for cell in cells))
    shares = []
    for chain in chains:
        mine = [cell for cell in cells if cell.names[0] == chain]
        ours, theirs = (100 * np.array([c.coverage(getattr(c, which)) for c in mine]) for which in ("sigma", "paper_sigma"))
        spans = f"{ours.mean():.0f} % ({ours.min():.0f} to {ours.max():.0f} %)", f"{theirs.mean():.0f} %"
        shares.append(f"{spans[0]} of cases{f' in chain {chain}' if len(chains) > 1 else ''}, two of the paper's in {spans[1]}")
    return f"Two corrected sigma hold the truth in {'; '.join(shares)} (lowest to highest of single parameters; 95 % is right)."


def failures(cells: Sequence[Cell]) -> str:
    """Return how many identifications failed; empty if none did."""
    failed = sum(cell.failures.total() for cell in cells)
    every = failed + sum(cell.runs for cell in cells)
    return f"{failed:,} of {every:,} identifications failed; their reasons are listed." if failed else ""


def combination(cell: Cell) -> str:
    """Return the settings of a cell in words."""
    return ", ".join(f"{short(name)} {value(x)}" for name, x in cell.settings.items())


def method(cell: Cell, among: Sequence[Cell]) -> str:
    """Return how a cell was identified: its model, and chain and estimator where those of other cells differ."""
    chain, estimator, model = cell.names
    told = [f"chain {chain}"] if any(other.names[0] != chain for other in among) else []
    told += [estimator] if any(other.names[1] != estimator for other in among) else []
    return f"{model} ({', '.join(told)})" if told else f"{model} model" if len(among) == 1 else model


def where(cell: Cell, among: Sequence[Cell]) -> str:
    """Return the settings of a cell, and how it was identified, in words."""
    return f"{combination(cell)}, {method(cell, among)}"


def short(field: str) -> str:
    """Return the name of a field without the word that all of its kind begin with."""
    return field.removeprefix("chain.")


def value(x: Any) -> str:
    """Return the value of an axis as text."""
    return f"{x:.6g}" if isinstance(x, float) else str(x)


def percent(share: float) -> str:
    """Return a share as a percentage of two digits."""
    return f"{100 * share:.0f} %" if share >= 1 else f"{100 * share:.2g} %"
