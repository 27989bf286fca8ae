"""Ordinary least squares."""

from dataclasses import dataclass
from typing import final

import numpy as np

from identify.estimate import Estimate
from identify.estimators.base import AbstractEstimator, Problem
from identify.system import Status


@final
@dataclass(frozen=True)
class OrdinaryLeastSquares(AbstractEstimator):
    """Ordinary least squares, X = argmin |Y - W X|^2, by QR (section 5)."""

    def solve(self, problem: Problem) -> Estimate:
        """Return R^-1 Q' Y, NaN where W has not full rank."""
        system = problem.system
        ok = system.status == Status.OK
        p = len(system.parameters)
        R = np.where(ok[..., None, None], system.R_W, np.eye(p))
        X = np.linalg.solve(R, system.R[..., :p, p:])[..., 0]
        return Estimate.judge(system, np.where(ok[..., None], X, np.nan), solved=system)
