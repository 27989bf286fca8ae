"""Least squares of the most informative rows."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from idbench.identify.arrays import Array, frozen
from idbench.identify.errors import require_positive
from idbench.identify.estimators.estimate import Estimate
from idbench.identify.estimators.estimator import AbstractEstimator
from idbench.identify.estimators.problem import Problem
from idbench.identify.estimators.simulating.row_products import with_weights
from idbench.identify.estimators.solution import Given
from idbench.identify.rows.operators.windows import AbstractWeakForm

RIDGE = 1e-9  # Initial information about every parameter, as a share of that of all rows; it regularizes the first p selections


@dataclass(frozen=True)
class SelectedRows(AbstractEstimator):
    """Ordinary least squares of selected rows (OLS-selected): a D-optimal set of windows that do not overlap.

    The energy model's sampling times ta and tb are free; [15, 18] of the paper choose them for a well-conditioned W. Rows are
    selected greedily: each adds most to ln det(W' W), which is the one with the largest w' M^-1 w, where M is the sum of w w'
    so far. Rows that overlap it are excluded. It needs overlapping windows, such as `Windows(length, spacing)`; where none
    overlap, all are selected. The number of rows and Cond(W) of the estimate are those of all windows.
    """

    acronym: ClassVar[str] = "OLS"

    apart: float | None = None
    """Minimum time between selected rows [s]; by default the length of a window."""

    def __post_init__(self) -> None:
        if self.apart is not None:
            require_positive(apart=self.apart)

    def solve(self, problem: Problem) -> Estimate:
        """Return the estimate of every run."""
        rows, operator, fs = problem.rows, problem.own_chain.operator, problem.logs[0].fs
        # All rows that are no integrals are selected.
        length = (len(operator.response(fs)) - 1) / fs if isinstance(operator, AbstractWeakForm) else 0.0
        apart = length if self.apart is None else self.apart
        starts = np.concatenate([np.full(len(part.time) * rows.kinds, k) for k, part in enumerate(rows.maps)])
        weight = np.zeros(rows.Y.shape)
        for run in np.ndindex(rows.Y.shape[:-1]):
            weight[run] = selected(rows.W[run], rows.valid[run], rows.time, starts, apart)
        found = with_weights(rows.Y, rows.W, weight)
        return Estimate(problem, frozen(found.X), frozen(found.covariance), Given(found.G))


def selected(W: Array, valid: npt.NDArray[np.bool_], time: Array, log: Array, apart: float) -> npt.NDArray[np.bool_]:
    """Mask of the selected rows, shape (r,), by the greedy step k = argmax w_k' M^-1 w_k of `SelectedRows`.

    Rows W, shape (r, p), may be selected where they are valid; `time` is their instant [s], and `log` the number of their log,
    shape (r,). The rows of one sample are selected one by one.
    """
    gaps = np.diff(time)[(np.diff(log) == 0) & (np.diff(time) > 0)]
    if not len(gaps) or gaps.min() >= apart * (1 - 1e-9):
        return valid.copy()
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
