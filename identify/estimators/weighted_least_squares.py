"""Weighted least squares."""

from dataclasses import dataclass
from typing import final

import numpy as np

from identify.arrays import Array, require_whole
from identify.estimate import Estimate
from identify.estimators.base import AbstractEstimator, Problem
from identify.estimators.ordinary_least_squares import OrdinaryLeastSquares
from identify.system import System


@final
@dataclass(frozen=True)
class WeightedLeastSquares(AbstractEstimator):
    """Weighted least squares (IDIM-WLS): rows divided by their noise, which the residuals of each joint tell.

    After M. Gautier, "Dynamic identification of robots with power model", Proc. IEEE ICRA 1997: the standard deviation of each
    joint's rows is that of their residual. Rows whose noise is known to differ within a group are first divided by it. Sigma
    is that of the weighted rows; Cond(W) and residuals are those of the rows as they were.

    Parameters
    ----------
    rounds : int
        How often weights are taken from the residuals of the estimate before, at least 1.
    """

    rounds: int = 2

    def __post_init__(self) -> None:
        require_whole(1, rounds=self.rounds)

    def solve(self, problem: Problem) -> Estimate:
        """Return the estimate of the weighted rows."""
        system = problem.system.weighted(1 / np.where(problem.system.valid, problem.system.noise, 1.0))
        estimate = OrdinaryLeastSquares().solve(Problem(system))
        for _ in range(self.rounds):
            estimate = OrdinaryLeastSquares().solve(Problem(system.weighted(1 / _level(system, estimate.X))))
        return Estimate.judge(problem.system, estimate.X, solved=estimate.system)


def _level(system: System, X: Array) -> Array:
    """Return the rms of the residuals of every row's group, shape (..., r); 1 where there is none."""
    residual, level = system.Y - np.matmul(system.W, X[..., None])[..., 0], np.ones_like(system.Y)
    for group in np.unique(system.group):
        rows = system.group == group
        count = system.count(rows)[..., None]
        # Sums over all rows, not over picked ones: their order in memory would depend on the number of runs.
        squares = np.sum(residual**2 * rows, axis=-1, keepdims=True)
        level[..., rows] = np.sqrt(squares / np.maximum(count, 1))
    # Noise-free rows leave residuals of rounding; weights below 1e-12 of the measurements would say nothing.
    floor = 1e-12 * np.sqrt(np.mean(system.Y**2, axis=-1, keepdims=True))
    return np.where(np.isfinite(level), np.maximum(level, np.maximum(floor, 1e-300)), 1.0)
