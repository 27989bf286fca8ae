"""The answer of a study in two sentences, computed from its cells, and its worst runs."""

from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import takewhile
from math import comb, log2
from pathlib import Path
from shlex import quote
from typing import Any

import numpy as np

from idbench.experiments.program import program
from idbench.experiments.study.axis import FRICTION
from idbench.experiments.study.statistics import SURE, Cell, differences
from idbench.experiments.study.study import Study

LEVELS = (0.1, 0.01, 0.001, 0.0001)  # Typical errors that are asked for
MAX_NAMED = 2  # Errors that are named
LINES = "encoder.lines"  # The setting that people know as bits


def requirements(cells: Sequence[Cell], edges: int = 4) -> str:
    """Threshold of some typical errors on the only setting that varies, in words; empty if it does not decide the error."""
    fields = [field for field in cells[0].settings if field != FRICTION]
    varied = [field for field in fields if len({str(cell.settings[field]) for cell in cells}) > 1]
    if len(varied) != 1 or not all(isinstance(cell.settings[varied[0]], float) for cell in cells):
        return ""
    found = list(_requirements(cells, varied[0], edges))[-MAX_NAMED:]
    each = [f"{level} {bound} {value}" if k == 0 else f"{level} {value}" for k, (level, bound, value) in enumerate(found)]
    return f"a typical error of {', '.join(each)}" if found else ""


def _requirements(cells: Sequence[Cell], field: str, edges: int) -> Iterator[tuple[str, str, str]]:
    """Yield each level, the bound that it requires, and its value, the largest error first."""
    falling = sorted(cells, key=lambda cell: cell.settings[field])
    rises = falling[-1].typical > falling[0].typical
    weakest_first = falling[::-1] if rises else falling
    for level in LEVELS:
        enough = [k for k in range(len(weakest_first)) if all(cell.typical <= level for cell in weakest_first[k:])]
        if enough and enough[0] > 0:
            value = weakest_first[enough[0]].settings[field]
            bound = f"requires {field} of at {'most' if rises else 'least'}"
            yield f"{100 * level:g} %", bound, in_words(value, field, edges)


def in_words(value: object, field: str = "", edges: int = 4) -> str:
    """Return the value of a setting as text, lines of an encoder with their bits."""
    if not isinstance(value, float):
        return str(value)
    bits = f" ({log2(edges * value):.3g} bits)" if field == LINES and value > 0 else ""
    return f"{value:.6g}{bits}"


def answer(cells: Sequence[Cell], edges: int = 4) -> str:
    """Best model and chain, its margin, and the coverage of its sigma, in words; `edges` as `Study.edges`."""
    solved = [cell for cell in cells if cell.runs]
    if not solved:
        return f"No run gave an estimate. {failures(cells)}"
    parts = _who(solved), _asked(solved, edges), _sigmas(solved), failures(cells)
    return " ".join(filter(None, parts))


def headline(cells: Sequence[Cell], edges: int = 4) -> str:
    """Return the answer in a few words: what an error of a size takes, or else which method errs least, and by how much."""
    if not (solved := [cell for cell in cells if cell.runs]):
        return "no run gave an estimate"
    groups = list(grouped(solved).values())
    best = [_best(group) for group in groups]
    if asked := requirements(best, edges):
        return asked
    (winner, count), *_ = Counter(method(cell, solved) for cell in best).most_common(1)
    low, high = (percent(pick(c.typical for c in solved if method(c, solved) == winner)) for pick in (min, max))
    errors = f"typical error {low}" if len(best) == 1 else f"typical errors {low} to {high}"
    share = f" in {count} of {len(best)} settings" if count < len(best) else ""
    return errors if len(solved) == len(groups) else f"least with {winner}{share}: {errors}"


def _asked(cells: Sequence[Cell], edges: int) -> str:
    """Sentence on the settings that typical errors of the best methods need; empty if nothing varies."""
    asked = requirements([_best(group) for group in grouped(cells).values()], edges)
    return f"{asked[0].upper()}{asked[1:]}." if asked else ""


def grouped(cells: Sequence[Cell]) -> dict[str, list[Cell]]:
    """Return the cells of the same runs, by their settings in words."""
    groups: dict[str, list[Cell]] = {}
    for cell in cells:
        groups.setdefault(combination(cell), []).append(cell)
    return groups


def _who(cells: Sequence[Cell]) -> str:
    """Best method, its margin and its error, in words."""
    groups = list(grouped(cells).values())
    best = [_best(group) for group in groups]
    low, high = min(best, key=lambda c: c.typical), max(best, key=lambda c: c.typical)
    ends = [f"{percent(cell.typical)} ({combination(cell)})" for cell in (low, high)]
    span = (
        f"the typical error of the best goes from {' to '.join(ends)}" if len(best) > 1 else f"its typical error is {ends[0]}"
    )
    if len(cells) == len(groups):
        return f"With the {best[0].names[2]} model {span}."
    if 2 * 0.5 ** max(cell.runs for cell in cells) * comb(len(groups[0]), 2) >= SURE:
        least = [method(cell, cells) for cell in best]
        winner = max(dict.fromkeys(least), key=least.count)
        share = f"{least.count(winner)} of {len(groups)} settings"
        return f"Least typical error in {share}: {winner} (too few runs for a test); {span}."
    return f"{_winners(groups, best, cells)}; {span}."


def _winners(groups: Sequence[Sequence[Cell]], best: Sequence[Cell], cells: Sequence[Cell]) -> str:
    """Methods that are least often significantly worse than another, and how often they are best.

    A combination in which another errs less, but not significantly, does not count against them.
    """
    rivals = [_not_worse(group, cell, cells) for group, cell in zip(groups, best, strict=True)]
    counts = Counter(name for names in rivals for name in names)
    first = [method(cell, cells) for cell in best]
    winners = sorted((name for name, count in counts.items() if count == max(counts.values())), key=first.count, reverse=True)
    unbeaten = max(counts.values())
    lonely = sum(len(group) == 1 for group in groups)
    words = [f"Least typical error: {' and '.join(winners)}"]
    sure = sum(set(names) <= set(winners) for names in rivals) if len({method(c, cells) for c in cells}) > len(winners) else 0
    if sure == len(groups):
        words.append(f"best{f' in all {sure} settings' if sure > 1 else ''} (p < {SURE:g})")
    elif len(groups) > 1 or unbeaten < len(groups):
        words.append(f"best or not significantly worse in {unbeaten} of {len(groups)} settings")
        words += [f"best in {sure} (p < {SURE:g})"] if sure else []
    words += [f"the only one with an estimate in {lonely}"] if lonely else []
    tied = sum(len(set(names) & set(winners)) > 1 for names in rivals)
    between = f"; no significant difference between them{f' in {tied}' if len(groups) > 1 else ''}" if len(winners) > 1 else ""
    return ", ".join(words) + between


def _best(group: Sequence[Cell]) -> Cell:
    """Return the cell with the least typical error, of those that identified most of the runs."""
    most = max(cell.runs for cell in group)
    return min((cell for cell in group if cell.runs > most / 2), key=lambda cell: cell.typical)


def _not_worse(group: Sequence[Cell], best: Cell, cells: Sequence[Cell]) -> tuple[str, ...]:
    """Return the best cell of a group, and those that are not significantly worse."""
    worse = {d.worse for d in differences(group) if d.better is best and d.p < SURE}
    return tuple(method(cell, cells) for cell in group if cell not in worse)


def _sigmas(cells: Sequence[Cell]) -> str:
    chains = list(dict.fromkeys(cell.names[0] for cell in cells))
    shares = []
    for chain in chains:
        mine = [cell for cell in cells if cell.names[0] == chain]
        ours, theirs = (100 * np.array([c.coverage(getattr(c, which)) for c in mine]) for which in ("sigma", "paper_sigma"))
        if not np.isfinite(ours).any():
            continue
        span = f"{np.nanmin(ours):.0f} to {np.nanmax(ours):.0f} % for single parameters and settings"
        whose = f" with chain {chain}" if len(chains) > 1 else ""
        shares.append(f"{np.nanmean(ours):.0f} %{whose} ({span}; the paper's sigma {np.nanmean(theirs):.0f} %)")
    if not shares:
        return "Standard errors are not calibrated."
    return f"The true value lies within two standard errors in {' and '.join(shares)} of cases; 95 % would be right."


HALF = 0.5  # Share of the runs in which a fault is named, above which it counts as seen


def smallest_named(cells: Sequence[Cell], field: str) -> str:
    """Least values of a setting from which on faults are named in most of the runs, each with the other settings."""
    groups, found = dict[str, list[Cell]](), dict[str, list[str]]()
    for cell in cells:
        others = [in_words(x) for name, x in settings_of(cell).items() if name != field]
        others += [method(cell, cells)] if len({method(each, cells) for each in cells}) > 1 else []
        groups.setdefault(" ".join(others) or "the fault", []).append(cell)
    for title, group in groups.items():
        rising = sorted(group, key=lambda cell: cell.settings[field], reverse=True)
        seen = list(takewhile(lambda cell: cell.named_share[0] > HALF, rising))
        found.setdefault(f"from {in_words(seen[-1].settings[field])} on" if seen else "never", []).append(title)
    each = "; ".join(f"{first}: {', '.join(titles)}" for first, titles in sorted(found.items()))
    wrong = np.mean([cell.named_share[1] for cell in cells])
    return f"In most runs a fault is named by {field} {each}. Another cause is named in {percent(float(wrong))} of all runs."


def failures(cells: Sequence[Cell]) -> str:
    """Sentence on the number of failed identifications; empty if none did."""
    failed = sum(cell.failed for cell in cells)
    every = failed + sum(cell.runs for cell in cells)
    return f"{failed:,} of {every:,} identifications failed; their reasons are listed." if failed else ""


def combination(cell: Cell) -> str:
    """Return the settings of a cell in words."""
    return ", ".join(f"{short(name)} {in_words(x)}" for name, x in settings_of(cell).items())


def settings_of(cell: Cell) -> dict[str, Any]:
    """Return the settings of a cell without the laws of friction: these are part of how it was identified."""
    return {name: x for name, x in cell.settings.items() if name != FRICTION}


def method(cell: Cell, among: Sequence[Cell]) -> str:
    """Method of a cell: its model, and chain, estimator and laws of friction where those of others differ."""
    chain, estimator, model = cell.names
    words = [f"chain {chain}"] if any(other.names[0] != chain for other in among) else []
    words += [estimator] if any(other.names[1] != estimator for other in among) else []
    laws = cell.settings.get(FRICTION)
    words += [str(laws)] if any(other.settings.get(FRICTION) != laws for other in among) else []
    return f"{model} ({', '.join(words)})" if words else model


def where(cell: Cell, among: Sequence[Cell]) -> str:
    """Return the settings of a cell, and how it was identified, in words."""
    return f"{combination(cell)}, {method(cell, among)}"


def short(field: str) -> str:
    """Return the name of a field without the word that all of its kind begin with."""
    return field.removeprefix("chain.")


def percent(share: float) -> str:
    """Return a share as a percentage of two digits."""
    return f"{100 * share:.0f} %" if share >= 1 else f"{100 * share:.2g} %"


WORST = 10  # Runs that are listed


def worst_runs(cells: Sequence[Cell]) -> list[tuple[Cell, str, float, int]]:
    """Return the identifications with the largest relative errors: cell, parameter, error, run.

    The worst run of each combination and model comes first, so that not all are of one kind; each run is there once.
    """
    firsts, others = list[tuple[Cell, str, float, int]](), list[tuple[Cell, str, float, int]]()
    for cell in cells:
        p = np.nan_to_num(np.abs(cell.error)).argmax(axis=1)
        own = [(cell, cell.parameters[j], float(cell.error[i, j]), int(cell.run[i])) for i, j in enumerate(p)]
        own.sort(key=_by_size)
        firsts += own[:1]
        others += own[1:]
    worst: dict[int, tuple[Cell, str, float, int]] = {}
    for entry in [*sorted(firsts, key=_by_size), *sorted(others, key=_by_size)]:
        worst.setdefault(entry[3], entry)
    return list(worst.values())[:WORST]


def _by_size(entry: tuple[Cell, str, float, int]) -> float:
    return -abs(entry[2])


def command(study: Study, folder: Path, cell: Cell, run: int) -> str:
    """Command that makes a run again, identified as in a cell."""
    number = next(i for i, found in enumerate(study.methods) if found.fits(*cell.names[:2], cell.settings))
    chosen = f" --method {number}" if number else ""
    return f"{program()} run --from {quote(str(folder))} --index {run}{chosen}"
