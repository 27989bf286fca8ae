"""Estimators that simulate the closed loop of a log: instrumental variables, DIDIM, closed-loop input and output error."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from idbench.identify.arrays import TINY, Array
from idbench.identify.data.motion_log import MotionLog
from idbench.identify.estimators.estimate import Estimate
from idbench.identify.estimators.problem import Problem
from idbench.identify.estimators.simulating.row_products import Kinds, Solved, scatter, solve_with
from idbench.identify.estimators.simulating.simulated_rounds import (
    AbstractSimulating,
    Rounds,
    SecantSteps,
    rates,
    require_explicit,
    small_steps,
)
from idbench.identify.estimators.solution import Given


@dataclass(frozen=True)
class DirectInverse(AbstractSimulating):
    """Direct and inverse dynamic identification (DIDIM): least squares of the measured torques on the simulated robot's rows.

    The robot with the parameters of the round before is simulated in its closed loop; measured positions take no part. The rows
    of both have the mask of the log. It makes the simulated torques those of the log, as CLIE does, with one simulation a round
    (M. Gautier, A. Janot and P.-O. Vandanjon, "A new closed-loop output error method for parameter identification of robot
    dynamics", IEEE Trans. Control Systems Technology 21 (2013) 428-444). A wrong controller in the simulation makes it wrong.
    """

    settled: float = 0.1
    acronym: ClassVar[str] = "DIDIM"

    def solve(self, problem: Problem) -> Estimate:
        """Return the estimate of every run."""
        rounds = self.begun(problem)
        rows = problem.rows
        kinds = Kinds.of_rows(problem)

        def step(X: Array) -> Solved:
            W = problem.at(rounds.simulated(X).logs).W
            return solve_with(kinds, rows.Y, W, W)

        found = rounds.until_settled(step, rounds.start(), SecantSteps())
        return rounds.estimate(found, calibrated=scatter(found, kinds, rates(problem)))


@dataclass(frozen=True)
class InstrumentalVariables(AbstractSimulating):
    """Instrumental variables (IDIM-IV), X = (Z' w^2 W)^-1 Z' w^2 Y, with Z the rows of the simulated robot.

    The robot with the parameters of the round before is simulated in its closed loop, without noise: the rows Z of its motion
    are those of the log, but for the log's noise. So noise of the positions in W leaves no bias (A. Janot, P.-O. Vandanjon and
    M. Gautier, "A generic instrumental variable approach for industrial robot identification", IEEE Trans. Control Systems
    Technology 22 (2014) 132-145). A wrong controller in the simulation makes the estimate less sure, not wrong; so do laws of
    friction that the simulated robot does not have.
    """

    settled: float = 0.1
    acronym: ClassVar[str] = "IV"

    def solve(self, problem: Problem) -> Estimate:
        """Return the estimate of every run."""
        rounds = self.begun(problem, exact=False)
        rows = problem.rows
        kinds = Kinds.of_rows(problem)

        def step(X: Array) -> Solved:
            return solve_with(kinds, rows.Y, rows.W, problem.at(rounds.simulated(X).logs).W)

        found = rounds.until_settled(step, rounds.start(), SecantSteps())
        return rounds.estimate(found, solution=Given(found.G))


WORSE = 1.2  # Growth of the rms of the residuals at which a step counts as too long

Output = Callable[[tuple[MotionLog, ...]], Array]
"""Logs of shape (..., time, joint) -> what is compared, shape (..., r)."""


def gauss_newton(problem: Problem, rounds: Rounds, output: Output, kinds: Kinds) -> Solved:
    """Return the parameters with which simulated logs have the output of those of the problem, in the least squares.

    Each round simulates all p + 1 robots at once. A step that makes the residuals grow is halved. The first is one of least
    squares of the torques on the simulated rows, for which a start may be far off.
    """
    measured, h = output(problem.logs), small_steps(problem)
    X = rounds.start()
    W = problem.at(rounds.simulated(X).logs).W
    X = solve_with(Kinds.of_rows(problem), problem.rows.Y, W, W).X
    rounds.path.append(X)
    p = X.shape[-1]
    unit = np.eye(p).reshape(p, *[1] * (X.ndim - 1), p)
    best, least = X, np.full(X.shape[:-1], np.inf)  # parameters of the least residuals so far, run by run, and these

    def step(X: Array) -> Solved:
        nonlocal best, least
        every = np.concatenate([X[None], X + h * unit])
        made = output(rounds.simulated(every).logs)
        J = np.moveaxis(made[1:] - made[0], 0, -1) / h[..., None, :]
        residual = measured - made[0]
        found = solve_with(kinds, residual, J, J)
        size = np.sqrt(np.mean(kinds.by_kind(residual * kinds.own) ** 2, axis=-2))
        size = np.nan_to_num(np.exp(np.mean(np.log(np.maximum(size, TINY)), axis=-1)), nan=np.inf)
        # Half the way back from where residuals are larger than they were.
        ahead = np.where((size > WORSE * least)[..., None], (X + best) / 2, X + found.X)
        better = size < least
        best, least = np.where(better[..., None], X, best), np.where(better, size, least)
        return replace(found, X=ahead)

    return rounds.until_settled(step, X)


@dataclass(frozen=True)
class ClosedLoopInputError(AbstractSimulating):
    """Closed-loop input error (CLIE), X = argmin |tau - tau_s(X)|^2, with tau_s the torques of the robot in its closed loop.

    By Gauss-Newton, p + 1 simulations a round; both torques pass the filter and the mask of the log. DIDIM gives the same for a
    p-th of the simulations. A wrong controller in the simulation makes it wrong.
    """

    acronym: ClassVar[str] = "CLIE"

    def solve(self, problem: Problem) -> Estimate:
        """Return the estimate of every run; raise IdentificationError if the model is not the explicit one."""
        require_explicit(problem, "CLIE", "torques", "; DIDIM has all")

        def torques(logs: tuple[MotionLog, ...]) -> Array:
            each = zip(problem.rows.maps, logs, strict=True)
            return np.concatenate(
                [part.measurement(problem.chain.signals(log, part.signals).torque.mean) for part, log in each], axis=-1
            )

        rounds, kinds = self.begun(problem), Kinds.of_rows(problem)
        found = gauss_newton(problem, rounds, torques, kinds)
        return rounds.estimate(found, calibrated=scatter(found, kinds, rates(problem)))


@dataclass(frozen=True)
class ClosedLoopOutputError(AbstractSimulating):
    """Closed-loop output error (CLOE), X = argmin |q - q_s(X)|^2, with q_s the positions of the robot in its closed loop.

    By Gauss-Newton, p + 1 simulations a round. The loop hides the parameters: it makes positions what they should be, whatever
    the robot. Neither filter nor mask take part. A wrong controller in the simulation makes it wrong.
    """

    acronym: ClassVar[str] = "CLOE"
    filtered: ClassVar[bool] = False

    def solve(self, problem: Problem) -> Estimate:
        """Return the estimate of every run; raise IdentificationError if the model is not the explicit one."""
        require_explicit(problem, "CLOE", "positions")
        measured = positions(problem.logs)
        rounds, kinds = self.begun(problem), Kinds(problem.basis.n, np.ones(measured.shape))
        found = gauss_newton(problem, rounds, positions, kinds)
        ends = np.cumsum([0, *(log.samples * log.n for log in problem.logs)]).tolist()
        parts = [(slice(ends[k], ends[k + 1]), log.fs) for k, log in enumerate(problem.logs)]
        return rounds.estimate(found, calibrated=scatter(found, kinds, parts))


def positions(logs: tuple[MotionLog, ...]) -> Array:
    """Return the positions of logs, one after the other, shape (..., r)."""
    return np.concatenate([log.q.reshape(*log.q.shape[:-2], -1) for log in logs], axis=-1)
