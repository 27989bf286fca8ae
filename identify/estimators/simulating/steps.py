"""Rounds X -> G(X) of an estimator that simulates: how far they still have to go, and where to go on."""

import numpy as np

from idbench.identify.arrays import Array

FARTHEST = 1.0  # Share of the last two answers' difference by which the next round may begin beyond the last answer


class SecantSteps:
    """Rounds that leave a share of what was left, each direction its own.

    How much of its beginning an answer keeps is known along the line through the last two rounds. The next round begins where
    their steps along it cross zero (D. G. Anderson, "Iterative procedures for nonlinear integral equations", J. ACM 12 (1965)
    547-560, with a memory of one). Of the rest of a step half is taken to be left, at most.
    """

    def __init__(self) -> None:
        self._before: tuple[Array, Array] | None = None

    def taken(self, X: Array, G: Array, unit: Array) -> tuple[Array, Array]:
        """Return an upper bound of the remaining distance [units], shape (...), and the start of the next step, shape (..., p).

        Parameters
        ----------
        X, G : Array, shape (..., p)
            Parameters before and after the round.
        unit : Array, shape (..., p)
            What a step counts in, such as sigma.
        """
        before, self._before = self._before, (X, G)
        step = (G - X) / unit
        if before is None:
            return largest(step), G
        answered = G - before[1]
        change = (answered - (X - before[0])) / unit
        square = np.sum(change**2, axis=-1, keepdims=True)
        c = np.divide(np.sum(change * step, axis=-1, keepdims=True), square, out=np.zeros_like(square), where=square > 0)
        left = largest(c * answered / unit) + largest(step - c * change)
        return left, G - np.where(np.abs(c) <= FARTHEST, c, 0.0) * answered


def largest(steps: Array) -> Array:
    """Largest step of a parameter, by size, shape (...)."""
    found: Array = np.max(np.abs(steps), axis=-1)
    return found
