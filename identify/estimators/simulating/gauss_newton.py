"""Gauss-Newton on what a robot in its closed loop does, by simulating it with each parameter changed a little."""

from collections.abc import Callable

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.data.motion_log import MotionLog
from idbench.identify.estimators.problem import Problem
from idbench.identify.estimators.simulating.row_products import Kinds, Solved, solve_with
from idbench.identify.estimators.simulating.simulated_rounds import Rounds, small_steps

WORSE = 1.2  # Growth of the rms of the residuals at which a step counts as too long

Output = Callable[[tuple[MotionLog, ...]], Array]
"""Logs of shape (..., time, joint) -> what is compared, shape (..., r)."""


def gauss_newton(problem: Problem, rounds: Rounds, output: Output, kinds: Kinds) -> Solved:
    """Return the parameters with which simulated logs have the output of those of the problem, in the least squares.

    Each round simulates all p + 1 robots at once. A step that makes the residuals grow is halved. The first is one of least
    squares of the torques on the simulated rows, for which a start may be far off.

    Parameters
    ----------
    problem : Problem
        What is solved.
    rounds : Rounds
        How long.
    output : callable
        What is compared.
    kinds : Kinds
        Which residuals have the same variance.
    """
    measured, h = output(problem.logs), small_steps(problem)
    X = rounds.start()
    W = problem.at(rounds.simulated(X).logs).W
    X = solve_with(Kinds.of_rows(problem), problem.rows.Y, W, W).X
    rounds.path.append(X)
    line, p = _Line(), X.shape[-1]
    unit = np.eye(p).reshape(p, *[1] * (X.ndim - 1), p)

    def step(X: Array) -> Solved:
        every = np.concatenate([X[None], X + h * unit])
        made = output(rounds.simulated(every).logs)
        J = np.moveaxis(made[1:] - made[0], 0, -1) / h[..., None, :]
        return line.shortened(solve_with(kinds, measured - made[0], J, J).moved(X), X, measured - made[0], kinds)

    return rounds.until_settled(step, X)


class _Line:
    """The parameters of the least residuals so far, run by run."""

    def __init__(self) -> None:
        self._best: Array | None = None
        self._least: Array = np.empty(0)

    def shortened(self, found: Solved, X: Array, residual: Array, kinds: Kinds) -> Solved:
        """Return a step as it is, or, if it began where residuals are larger than they were, half the way back."""
        size = np.sqrt(np.mean(kinds.by_kind(residual * kinds.own) ** 2, axis=-2))
        size = np.nan_to_num(np.exp(np.mean(np.log(np.maximum(size, 1e-300)), axis=-1)), nan=np.inf)
        if self._best is None:
            self._best, self._least = X, size
            return found
        worse = size > WORSE * self._least
        back = Solved((X + self._best) / 2, found.G, found.residual, found.covariance)
        better = size < self._least
        self._best = np.where(better[..., None], X, self._best)
        self._least = np.where(better, size, self._least)
        return back.where(worse, found)
