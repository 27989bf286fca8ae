"""Closed-loop output error (CLOE)."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.data.motion_log import MotionLog
from idbench.identify.estimators.estimate import Estimate
from idbench.identify.estimators.estimator import Need
from idbench.identify.estimators.problem import Problem
from idbench.identify.estimators.simulating.gauss_newton import gauss_newton
from idbench.identify.estimators.simulating.residual_scatter import scatter
from idbench.identify.estimators.simulating.row_products import Kinds
from idbench.identify.estimators.simulating.simulated_rounds import AbstractSimulating, rates, require_explicit


@dataclass(frozen=True)
class ClosedLoopInputError(AbstractSimulating):
    """Closed-loop input error (CLIE), X = argmin |tau - tau_s(X)|^2, with tau_s the torques of the robot in its closed loop.

    By Gauss-Newton, p + 1 simulations a round; both torques pass the filter and the mask of the log. DIDIM gives the same for a
    p-th of the simulations. A wrong controller in the simulation makes it wrong.
    """

    acronym: ClassVar[str] = "CLIE"
    needs: ClassVar[frozenset[Need]] = frozenset({"rows", "loop"})

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
    needs: ClassVar[frozenset[Need]] = frozenset({"rows", "loop"})
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
