"""Whether two ways of identification differ, on the same runs."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy import stats

from experiments.study.statistics import Cell


@dataclass(frozen=True, eq=False)
class Difference:
    """Whether two ways of identification differ, on the same runs.

    Parameters
    ----------
    better, worse : Cell
        The two.
    ratio : float
        Typical error of the worse over that of the better, as the geometric mean over runs and parameters.
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
    mean = float(gap.mean()) if len(gap) else 0.0
    better, worse = (a, b) if mean <= 0 else (b, a)
    p = float(stats.wilcoxon(gap).pvalue) if np.any(gap) else 1.0
    return Difference(better, worse, float(np.exp(abs(mean))), p, len(both))
