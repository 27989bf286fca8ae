"""Whether two ways of identification differ, on the same runs."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import scipy

from experiments.study.statistics import Cell
from identify import Array

BISECTIONS = 50
"""Of the gap's range: to 1e-15 of it."""


@dataclass(frozen=True, eq=False)
class Difference:
    """Whether two ways of identification differ, on the same runs.

    Parameters
    ----------
    better, worse : Cell
        The two, in the direction of the statistic that is tested: errors may have tails that turn the sign of their mean.
    ratio : float
        Error of the worse over that of the better, over parameters as the geometric mean, over runs as the Hodges-Lehmann
        estimate that belongs to the test: the factor for which signed ranks balance.
    p : float
        Probability of so clear a difference if there were none (Wilcoxon's signed-rank test, paired over the runs, Holm's
        correction for all pairs).
    runs : int
        Runs that both could identify.
    """

    better: Cell
    worse: Cell
    ratio: float
    p: float
    runs: int


def differences(group: Sequence[Cell]) -> list[Difference]:
    """Return, for every pair of cells of the same runs, which is better and how sure that is."""
    found = [_difference(a, b) for a, b in combinations(group, 2)]
    order = sorted(range(len(found)), key=lambda i: found[i].p)
    corrected, least = {}, 0.0
    for rank, i in enumerate(order):
        least = max(least, min(1.0, (len(found) - rank) * found[i].p))
        corrected[i] = least
    return [Difference(d.better, d.worse, d.ratio, corrected[i], d.runs) for i, d in enumerate(found)]


def _difference(a: Cell, b: Cell) -> Difference:
    one, other = a.losses(), b.losses()
    both = sorted(one.keys() & other.keys())
    gap = np.array([one[run] - other[run] for run in both])
    better, worse = (a, b) if _signed_ranks(gap[gap != 0]) <= 0 else (b, a)
    p = float(scipy.stats.wilcoxon(gap).pvalue) if np.any(gap) else 1.0
    return Difference(better, worse, float(np.exp(abs(_shift(gap)))) if both else 1.0, p, len(both))


def _signed_ranks(gap: Array) -> float:
    """Return the sum of the ranks of positive gaps less that of negative ones (Wilcoxon)."""
    return float(np.sign(gap) @ scipy.stats.rankdata(np.abs(gap)))


def _shift(gap: Array) -> float:
    """Return the shift of the gaps that makes their signed ranks balance (Hodges and Lehmann), by bisection."""
    low, high = float(gap.min()), float(gap.max())
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        balance = _signed_ranks(gap - middle)
        if not balance:
            return middle
        low, high = (middle, high) if balance > 0 else (low, middle)
    return (low + high) / 2
