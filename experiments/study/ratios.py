"""Ratios of the errors of models, on the same runs."""

from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any, TypeAlias

import numpy as np

from idbench.experiments.document import Conclusion
from idbench.experiments.study.answer import answer, combination, failures, headline, percent, smallest_named
from idbench.experiments.study.statistics import CONFIDENCE, Cell, ln_typical
from idbench.experiments.study.study import SEVERITY, Study
from idbench.experiments.text import new_table
from idbench.identify.models import THREE

DRAWS = 2000  # Of a bootstrap: the ends of an interval are then known to some 3 % of its width

PAIRS = (("implicit", "explicit"), ("power", "explicit"), ("energy", "power"), ("integral", "implicit"))
"""Models that are compared: the one whose errors are divided, and by whose."""

NOISES = {
    "ripple": "with ripple",
    "torque": "with white torque noise",
    "encoder": "with a 14-bit encoder alone",
    "all": "with all of them",
}
"""Noises of the study, in words."""

STATED = "idbench", "OLS"  # Chain and estimator whose ratios are stated one by one: the paper solves by ordinary least squares

RatioRow: TypeAlias = Mapping[str, Any]
"""A ratio as `summary.json` of the study has it."""


@lru_cache(maxsize=4096)
def ratio(cell: Cell, base: Cell) -> RatioRow:
    """Return the ratio of the typical errors of two cells on the runs that both identified; the same at every call.

    Geometric means, over the parameters, of the rms over the runs are divided; the confidence interval is by the bootstrap over
    runs. NaN if no run has both.
    """
    _, mine, theirs = np.intersect1d(cell.run, base.run, return_indices=True)
    whole = low = high = np.nan
    if len(mine):
        known = cell.relative & base.relative
        squares = [each.error[index][:, known] ** 2 for each, index in ((cell, mine), (base, theirs))]
        counts = np.random.default_rng(0).multinomial(len(mine), np.full(len(mine), 1 / len(mine)), size=DRAWS) / len(mine)
        # A product by einsum: its bits do not depend on the number of threads.
        drawn, middle = (
            np.subtract(*(ln_typical(np.einsum("...r,rp->...p", share, x)) for x in squares))
            for share in (counts, np.full(len(mine), 1 / len(mine)))
        )
        whole = float(middle)
        low, high = np.exp(np.quantile(drawn, [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2]))
    return {
        "settings": dict(cell.settings),
        "chain": cell.names[0],
        "estimator": cell.names[1],
        "models": [cell.names[2], base.names[2]],
        "ratio": float(np.exp(whole)),
        "low": float(low),
        "high": float(high),
        "runs": len(mine),
    }


def ratios(cells: Sequence[Cell]) -> Iterator[tuple[Cell, RatioRow]]:
    """Yield the ratios of `PAIRS` of cells that differ in their model alone, each behind the cell whose errors are divided."""
    groups: dict[tuple[Any, ...], dict[str, Cell]] = {}
    for cell in cells:
        if cell.runs:
            groups.setdefault((*map(str, cell.settings.values()), *cell.names[:2]), {})[cell.names[2]] = cell
    for group in groups.values():
        for above, below in PAIRS:
            if above in group and below in group:
                yield group[above], ratio(group[above], group[below])


def ratios_table(found: Sequence[tuple[Cell, RatioRow]]) -> Any:
    """Return the ratios as a table: a line for each way of identification, a column for each pair of models."""
    pairs = list(dict.fromkeys(pair_of(row) for _, row in found))
    lines: dict[tuple[str, ...], dict[str, str]] = {}
    for cell, row in found:
        lines.setdefault((combination(cell), *cell.names[:2]), {})[pair_of(row)] = interval(row)
    grid = new_table("ratios of typical errors, with 95 % confidence intervals", ["chain", "estimator", *pairs])
    for names, cells in lines.items():
        grid.add_row(*names, *(cells.get(pair, "") for pair in pairs))
    return grid


def conclusion(found: Sequence[RatioRow]) -> str:
    """Errors of the implicit and the power model relative to the explicit model's, with 95 % intervals, in words."""
    implicit, power = (_of(found, pair) for pair in (["implicit", "explicit"], ["power", "explicit"]))
    words = []
    if implicit:
        words.append(
            f"The implicit model's errors are {_span(implicit)} times the explicit model's, over {len(implicit)} "
            "combinations of noise, chain and estimator"
        )
    if stated := [row for row in power if (row["chain"], row["estimator"]) == STATED]:
        of = {str(row["settings"].get("noise", "")): row for row in stated}
        each = [f"{interval(row)} times {NOISES.get(noise, noise)}".rstrip() for noise, row in of.items()]
        each = each if len(of) == len(stated) else [f"{_span(stated)} times"]
        words.append(
            "With equal numbers of rows and ordinary least squares in chain "
            f"{STATED[0]}, the power model's are {', '.join(each)}"
        )
    elif power:
        words.append(f"With equal numbers of rows, the power model's are {_span(power)} times as large")
    papers = _of(power, ["power", "explicit"], chain="paper", estimator="OLS")
    if stated and (papers := [row for row in papers if row["settings"].get("noise") == "ripple"]):
        words[-1] += f" (the paper's experiment, with ripple and in its chain: {interval(papers[0])})"
    if stated and (weighted := _of(power, ["power", "explicit"], estimator="GLS")):
        best, worst = (pick(weighted, key=lambda row: row["ratio"]) for pick in (min, max))
        words[-1] += f"; with generalized least squares {interval(best)} to {interval(worst)} times"
    return " ".join(f"{sentence}." for sentence in words)


def _of(found: Sequence[RatioRow], pair: list[str], **given: str) -> list[RatioRow]:
    return [row for row in found if row["models"] == pair and all(row[key] == x for key, x in given.items())]


def _span(rows: Sequence[RatioRow]) -> str:
    low, high = (pick(row["ratio"] for row in rows) for pick in (min, max))
    return f"{low:.2g} to {high:.2g}"


def pair_of(row: RatioRow) -> str:
    """Return the names of both models."""
    return " / ".join(row["models"])


def interval(row: RatioRow) -> str:
    """Return a ratio with its interval, in words."""
    return f"{row['ratio']:.2g} ({row['low']:.2g} to {row['high']:.2g})"


def study_answer(study: Study, found: Sequence[Cell]) -> str:
    """Return the answer of a study: which faults are named, the ratios of the models' errors, or which method errs least."""
    if study.main_axis.field == SEVERITY and study.causes and (solved := [cell for cell in found if cell.runs]):
        return " ".join(filter(None, (smallest_named(solved, study.main_axis.field), failures(found))))
    if not (compares_models(study) and any(cell.runs for cell in found)):
        return answer(found, study.edges)
    parts = conclusion([row for _, row in ratios(found)]), failures(found)
    return " ".join(filter(None, parts)) or answer(found, study.edges)


def study_conclusion(study: Study, found: Sequence[Cell], step: str) -> Conclusion:
    """Return the answer of a study in a few words, and what to do next."""
    solved = [cell for cell in found if cell.runs]
    if study.causes and solved:
        wrong = np.mean([cell.named_share[1] for cell in solved])
        words = f"another cause than the fault is named in {percent(float(wrong))} of the runs"
    elif compares_models(study) and (rows := [row for _, row in ratios(found)]):
        spans = [f"{model} {_span(of)}" for model in ("implicit", "power") if (of := _of(rows, [model, "explicit"]))]
        words = f"errors over the explicit model's: {', '.join(spans)}"
    else:
        words = headline(found, study.edges)
    return Conclusion("", f"Result: {words}", step)


def compares_models(study: Study) -> bool:
    """True if a study compares the models over kinds of noise, by equal numbers of rows.

    It has too many methods for a test of every pair: the draws of a permutation test grow with the number of pairs.
    """
    noises = any(axis.field == "noise" for axis in study.axes)
    return study.rows == "equal" and set(THREE) <= set(study.models) and "GLS" in study.estimators and noises
