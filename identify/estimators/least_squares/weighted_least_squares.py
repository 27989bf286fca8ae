"""Weighted least squares."""

from dataclasses import dataclass
from typing import ClassVar, final

from idbench.identify.errors import require_whole
from idbench.identify.estimators.estimate import Estimate
from idbench.identify.estimators.estimator import AbstractEstimator, Need
from idbench.identify.estimators.problem import Problem


@final
@dataclass(frozen=True)
class WeightedLeastSquares(AbstractEstimator):
    """Weighted least squares (IDIM-WLS): rows divided by their noise, which the residuals of each joint give.

    After M. Gautier, "Dynamic identification of robots with power model", Proc. IEEE ICRA 1997: the standard deviation of each
    joint's rows is that of their residual. Rows of one kind whose noise differs, as in the power model, are first divided by
    what the noise of torques and positions makes of them. Sigma is that of the weighted rows; Cond(W) and residuals are those
    of the rows as they were.
    """

    acronym: ClassVar[str] = "WLS"
    needs: ClassVar[frozenset[Need]] = frozenset({"factors"})

    rounds: int = 2
    """How often weights are taken from the residuals of the estimate before, at least 1."""

    def __post_init__(self) -> None:
        require_whole(1, rounds=self.rounds)

    def solve(self, problem: Problem) -> Estimate:
        """Return the estimate of the weighted rows."""
        return Estimate.of_fit(problem, problem.scaled_factors.fit(self.rounds), scaled=True)
