"""Rounds X -> G(X) of an estimator that simulates: how far they still have to go, and where to go on."""

from typing import final

import numpy as np

from identify.arrays import Array

FARTHEST = 1.0
"""Share of the last two answers' difference by which the next round may begin beyond the last answer."""


class Steps:
    """Rounds that make small what is left faster than they can be foreseen, as those of Gauss and Newton do."""

    def taken(self, X: Array, G: Array, unit: Array, *, comparable: bool) -> tuple[Array, Array]:
        """Return what is left at most [units], shape (...), and where the next round begins, shape (..., p).

        Parameters
        ----------
        X, G : Array, shape (..., p)
            Parameters before and after the round.
        unit : Array, shape (..., p)
            What a step counts in, such as sigma.
        comparable : bool
            Whether the round is one of those that follow: the first may have been another one.
        """
        del comparable
        return _largest((G - X) / unit), G


@final
class SecantSteps(Steps):
    """Rounds each of which leaves the same share, about, of what was left.

    That share is how much two answers differ for how much their beginnings differed. The next round begins where the last two
    cross, in the least squares of their steps (D. G. Anderson, "Iterative procedures for nonlinear integral equations",
    J. ACM 12 (1965) 547-560, with a memory of one).
    """

    def __init__(self) -> None:
        self._before: tuple[Array, Array] | None = None

    def taken(self, X: Array, G: Array, unit: Array, *, comparable: bool) -> tuple[Array, Array]:
        """Return what is left at most [units], and where the next round begins."""
        before, self._before = self._before, (X, G) if comparable else None
        size = _largest((G - X) / unit)
        if before is None or not comparable:
            return size, G
        began, answered = X - before[0], G - before[1]
        share = _divided(_largest(answered / unit), _largest(began / unit), 1.0)
        left = np.where(share < 1, size * _divided(share, 1 - share, 1.0), size)
        change, step = (answered - began) / unit, (G - X) / unit
        c = _divided(np.sum(change * step, axis=-1), np.sum(change**2, axis=-1), 0.0)
        return np.minimum(left, size), G - np.where(np.abs(c) <= FARTHEST, c, 0.0)[..., None] * answered


def _largest(steps: Array) -> Array:
    found: Array = np.max(np.abs(steps), axis=-1)
    return found


def _divided(a: Array, b: Array, otherwise: float) -> Array:
    """Return a / b, or something else where that is no number."""
    with np.errstate(invalid="ignore", divide="ignore"):
        found = a / b
    return np.where(np.isfinite(found), found, otherwise)
