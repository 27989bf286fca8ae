"""Whether two ways of identification differ, on the same runs."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations

import numpy as np

from idbench.experiments.study.statistics import MIN_ERROR, Cell
from idbench.identify import Array

SURE = 0.01  # Probability below which two ways of identification count as different
DRAWS = 20_000  # Draws of the permutation test, at least
EACH = 2 / SURE  # Draws for each pair, at least, or Holm's correction would leave nothing significant
TOGETHER = 1000  # Draws that are made at a time
ENOUGH = 200  # Draws with a gap as large from which on no more are needed: nothing is significant then, and p is known to 7 %


@dataclass(frozen=True, eq=False)
class Difference:
    """Whether two ways of identification differ, on the same runs."""

    better: Cell
    """The one of smaller typical error."""
    worse: Cell
    """The other."""
    ratio: float
    """Typical error of the worse over that of the better: the geometric mean, over the parameters, of the rms over the runs."""
    p: float
    """Probability of so large a ratio if there were no difference (permutation test, paired over the runs, Holm's correction
    for all pairs)."""
    runs: int
    """Runs that both could identify."""


def differences(group: Sequence[Cell]) -> list[Difference]:
    """Return, for every pair of cells of the same runs, which is better and how sure that is."""
    pairs = list(combinations(group, 2))
    found = [_difference(a, b, max(DRAWS, int(EACH * len(pairs)))) for a, b in pairs]
    p = np.array([d.p for d in found])
    order, times = np.argsort(p, kind="stable"), np.arange(len(p), 0, -1)
    p[order] = np.maximum.accumulate(np.minimum(1.0, times * p[order]))
    return [replace(d, p=corrected) for d, corrected in zip(found, p.tolist(), strict=True)]


@lru_cache(maxsize=4096)
def _difference(a: Cell, b: Cell, draws: int) -> Difference:
    _, mine, theirs = np.intersect1d(a.run, b.run, return_indices=True)
    if not len(mine):
        return Difference(a, b, 1.0, 1.0, 0)
    known = a.relative & b.relative
    one, other = a.error[mine][:, known] ** 2, b.error[theirs][:, known] ** 2
    gap = float(ln_typical(one.mean(axis=0)) - ln_typical(other.mean(axis=0)))
    better, worse = (a, b) if gap <= 0 else (b, a)
    return Difference(better, worse, float(np.exp(abs(gap))), _probability(one, other, abs(gap), draws), len(mine))


def _probability(one: Array, other: Array, gap: float, draws: int) -> float:
    """Permutation p value of a gap between the typical errors of two methods, in logarithms, by at most so many draws.

    `one` and `other` are squares of their errors, shape (run, p).
    """
    rng = np.random.default_rng(0)
    count = 1
    drawn = 1
    middle, half = (one + other).mean(axis=0) / 2, (one - other) / (2 * len(one))
    while drawn < draws and count < ENOUGH:
        swapped = (1.0 - 2.0 * rng.integers(0, 2, (TOGETHER, len(one)), dtype=np.int8)) @ half
        gaps = ln_typical(middle + swapped) - ln_typical(middle - swapped)
        count, drawn = count + int(np.count_nonzero(np.abs(gaps) >= gap * (1 - 1e-9))), drawn + TOGETHER
    return count / drawn


def ln_typical(squares: Array) -> Array:
    """Return the logarithm of the typical error of mean squares, shape (..., p)."""
    return np.asarray(np.mean(np.log(np.maximum(squares, MIN_ERROR**2)), axis=-1) / 2)
