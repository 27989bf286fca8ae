"""Closed-loop input error (CLIE)."""

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np

from identify.arrays import Array
from identify.data.motion_log import MotionLog
from identify.errors import IdentificationError, require_positive, require_whole
from identify.estimators.estimate import Estimate
from identify.estimators.estimator import AbstractEstimator, Need
from identify.estimators.gauss_newton import gauss_newton
from identify.estimators.problem import Problem
from identify.estimators.residual_scatter import scatter
from identify.estimators.row_products import Kinds
from identify.estimators.simulated_rounds import Rounds, rates
from identify.models.explicit import ExplicitModel


@final
@dataclass(frozen=True)
class ClosedLoopInputError(AbstractEstimator):
    """Closed-loop input error (CLIE), X = argmin |tau - tau_s(X)|^2, with tau_s the torques of the robot in its closed loop.

    By Gauss-Newton, p + 1 simulations a round; both torques pass the filter and the mask of the log. DIDIM gives the same for a
    p-th of the simulations. A wrong controller in the simulation makes it wrong.

    Parameters
    ----------
    rounds : int
        Gauss-Newton steps at most.
    settled : float
        Step, in sigma, below which parameters count as settled.
    """

    needs: ClassVar[frozenset[Need]] = frozenset({"rows", "loop"})

    rounds: int = 10
    settled: float = 0.05

    def __post_init__(self) -> None:
        require_whole(1, rounds=self.rounds)
        require_positive(settled=self.settled)

    def solve(self, problem: Problem) -> Estimate:
        """Return the estimate of every run; raise IdentificationError if the model is not the explicit one."""
        if not isinstance(problem.model, ExplicitModel):
            raise IdentificationError("CLIE compares torques, not rows of a model: take --model explicit, or DIDIM")

        def torques(logs: tuple[MotionLog, ...]) -> Array:
            maps = problem.rows.maps
            return np.concatenate(
                [part.measurement(problem.chain.signals(log).torque.mean) for part, log in zip(maps, logs, strict=True)],
                axis=-1,
            )

        rounds, kinds = Rounds(problem, self.rounds, self.settled), Kinds.of_rows(problem)
        found = gauss_newton(problem, rounds, torques, kinds)
        return rounds.estimate(found, honest=scatter(found, kinds, rates(problem)))
