"""An estimator: it gets Y = W X + rho of a problem, and returns X with its sigma."""

from dataclasses import dataclass

import numpy as np

from idbench.identify import AbstractEstimator, Estimate, Problem


@dataclass(frozen=True)
class Starter(AbstractEstimator):
    """Least squares that draws X towards zero by a share of the columns' mean square (ridge)."""

    share: float = 1e-9
    """Weight of X itself, as a share of the mean square of W's columns: a setting, with its default."""

    def solve(self, problem: Problem) -> Estimate:
        """Return X = (W'W + k D)^-1 W'Y, with D the diagonal of W'W."""
        W, Y = problem.rows.W, problem.rows.Y[..., None]  # (..., row, p) and (..., row, 1); leading axes: runs
        square, one = np.swapaxes(W, -1, -2) @ W, np.eye(W.shape[-1])
        square = square + one * (square == 0)  # a run that shows nothing must not take the others away
        drawn = square + self.share * square * one
        G = np.swapaxes(np.linalg.solve(drawn, np.swapaxes(W, -1, -2)), -1, -2)  # X = G' Y: the influence of the rows
        X = np.sum(G * Y, axis=-2)
        return Estimate.judge(problem, X, influence=G)  # its sigma follows from G and the noise of the log
