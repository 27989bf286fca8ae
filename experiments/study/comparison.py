"""Whether two ways of identification differ, on the same runs."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from experiments.study.statistics import LEAST, Cell
from identify import Array

DRAWS, TOGETHER = 20_000, 1000
"""Of the permutation test, and how many are drawn at a time: enough for Holm's correction of a hundred pairs."""


@dataclass(frozen=True, eq=False)
class Difference:
    """Whether two ways of identification differ, on the same runs.

    Parameters
    ----------
    better, worse : Cell
        The two, by their typical errors.
    ratio : float
        Typical error of the worse over that of the better: the geometric mean, over the parameters, of the rms over the runs.
    p : float
        Probability of so large a ratio if there were no difference (permutation test, paired over the runs, Holm's correction
        for all pairs).
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
    _, mine, theirs = np.intersect1d(a.run, b.run, return_indices=True)
    if not len(mine):
        return Difference(a, b, 1.0, 1.0, 0)
    known = a.relative & b.relative
    one, other = a.error[mine][:, known] ** 2, b.error[theirs][:, known] ** 2
    gap = float(_ln_typical(one.mean(axis=0)) - _ln_typical(other.mean(axis=0)))
    better, worse = (a, b) if gap <= 0 else (b, a)
    return Difference(better, worse, float(np.exp(abs(gap))), _probability(one, other, abs(gap)), len(mine))


def _probability(one: Array, other: Array, gap: float) -> float:
    """Return how probable a gap is if it does not matter to which of two methods the errors of a run belong.

    Parameters
    ----------
    one, other : Array, shape (run, p)
        Squares of their errors.
    gap : float
        Difference of the logarithms of their typical errors.
    """
    rng, count = np.random.default_rng(0), 1
    middle, half = (one + other).mean(axis=0) / 2, (one - other) / (2 * len(one))
    for _ in range(DRAWS // TOGETHER):
        swapped = (1.0 - 2.0 * rng.integers(0, 2, (TOGETHER, len(one)), dtype=np.int8)) @ half
        drawn = _ln_typical(middle + swapped) - _ln_typical(middle - swapped)
        count += int(np.count_nonzero(np.abs(drawn) >= gap * (1 - 1e-9)))
    return count / (1 + DRAWS)


def _ln_typical(squares: Array) -> Array:
    """Return the logarithm of the typical error of mean squares, shape (..., p)."""
    return np.asarray(np.mean(np.log(np.maximum(squares, LEAST**2)), axis=-1) / 2)
