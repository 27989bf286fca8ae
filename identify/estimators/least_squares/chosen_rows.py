"""Least squares of the rows that say most."""

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np
import numpy.typing as npt

from idbench.identify.arrays import Array, frozen
from idbench.identify.errors import require_positive
from idbench.identify.estimators.estimate import Estimate
from idbench.identify.estimators.estimator import AbstractEstimator, Need
from idbench.identify.estimators.problem import Problem
from idbench.identify.estimators.simulating.row_products import with_weights
from idbench.identify.estimators.solution import Given

RIDGE = 1e-9
"""Information of every parameter before the first row is chosen, over that of all rows: it only starts the choice."""


@final
@dataclass(frozen=True)
class ChosenRows(AbstractEstimator):
    """Ordinary least squares of chosen rows (OLS-chosen): those that together say most, and do not overlap.

    The energy model's sampling times ta and tb are free, and [15, 18] of the paper choose them for a well conditioned W. Here
    rows are taken one by one, each the one that adds most to ln det(W' W) (D-optimal, greedy), and those that overlap it are
    left out: w' M^-1 w is largest, with M the sum of w w' so far. It needs windows that overlap: `Windows(length, spacing)`.
    """

    acronym: ClassVar[str] = "OLS-chosen"
    needs: ClassVar[frozenset[Need]] = frozenset({"rows"})

    apart: float | None = None
    """Least time between rows that are chosen [s]; by default the length of a window."""

    def __post_init__(self) -> None:
        if self.apart is not None:
            require_positive(apart=self.apart)

    def solve(self, problem: Problem) -> Estimate:
        """Return the estimate of every run, by the rows that are chosen of it."""
        rows, operator = problem.rows, problem.own_chain.operator
        apart = getattr(operator, "length", 0.0) if self.apart is None else self.apart
        starts = np.concatenate([np.full(len(part.time) * rows.kinds, k) for k, part in enumerate(rows.maps)])
        weight = np.zeros(rows.Y.shape)
        for run in np.ndindex(rows.Y.shape[:-1]):
            weight[run] = chosen(rows.W[run], rows.valid[run], rows.time, starts, apart)
        found = with_weights(rows.Y, rows.W, weight)
        return Estimate(problem, frozen(found.X), frozen(found.covariance), Given(found.G))


def chosen(W: Array, valid: npt.NDArray[np.bool_], time: Array, log: Array, apart: float) -> npt.NDArray[np.bool_]:
    """Return which rows are chosen, shape (r,).

    Parameters
    ----------
    W : Array, shape (r, p)
        Rows.
    valid : array, shape (r,)
        Rows that may be chosen.
    time, log : Array, shape (r,)
        Instant [s], and number of the log, of every row.
    apart : float
        Least time between chosen instants [s]; the rows of an instant are chosen one by one.
    """
    size = np.sqrt(np.sum(W**2, axis=0))
    W = W / np.where(size > 0, size, 1.0)
    inverse = np.eye(W.shape[1]) / RIDGE
    free, taken = valid.copy(), np.zeros(len(W), dtype=np.bool_)
    gain = np.einsum("rp,pq,rq->r", W, inverse, W)
    while free.any():
        k = int(np.argmax(np.where(free, gain, -1.0)))
        taken[k], free[k] = True, False
        free &= (log != log[k]) | (time == time[k]) | (np.abs(time - time[k]) >= apart * (1 - 1e-9))
        # Sherman and Morrison: (M + w w')^-1 = M^-1 - M^-1 w w' M^-1 / (1 + w' M^-1 w).
        step = inverse @ W[k] / np.sqrt(1 + gain[k])
        inverse = inverse - np.outer(step, step)
        gain = gain - (W @ step) ** 2
    return taken
