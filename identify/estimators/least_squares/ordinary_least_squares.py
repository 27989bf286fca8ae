"""Ordinary least squares."""

from dataclasses import dataclass
from typing import ClassVar, final

from idbench.identify.estimators.estimate import Estimate
from idbench.identify.estimators.estimator import AbstractEstimator, Need
from idbench.identify.estimators.problem import Problem


@final
@dataclass(frozen=True)
class OrdinaryLeastSquares(AbstractEstimator):
    """Ordinary least squares, X = argmin |Y - W X|^2, by QR (section 5)."""

    acronym: ClassVar[str] = "OLS"
    needs: ClassVar[frozenset[Need]] = frozenset({"factors"})

    def solve(self, problem: Problem) -> Estimate:
        """Return R^-1 Q' Y, NaN where W has not full rank."""
        return Estimate.of_fit(problem, problem.factors.fit(), scaled=False)
