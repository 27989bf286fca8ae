"""Generalized least squares."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from idbench.identify.arrays import frozen
from idbench.identify.errors import require_whole
from idbench.identify.estimators.estimate import Estimate
from idbench.identify.estimators.estimator import AbstractEstimator, Need
from idbench.identify.estimators.problem import Problem
from idbench.identify.estimators.solution import OfWhitenedRows
from idbench.identify.models import require_torques_once
from idbench.identify.rows.factors import Factor, Status, prior_rows


@dataclass(frozen=True)
class OrdinaryLeastSquares(AbstractEstimator):
    """Ordinary least squares, X = argmin |Y - W X|^2, by QR (section 5)."""

    acronym: ClassVar[str] = "OLS"
    needs: ClassVar[frozenset[Need]] = frozenset({"factors"})
    takes_prior: ClassVar[bool] = True

    def solve(self, problem: Problem) -> Estimate:
        """Return R^-1 Q' Y, NaN where W has not full rank."""
        return Estimate.of_fit(problem, problem.factors.fit(), scaled=False)


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
    takes_prior: ClassVar[bool] = True

    rounds: int = 2
    """How often weights are taken from the residuals of the estimate before, at least 1."""

    def __post_init__(self) -> None:
        require_whole(1, rounds=self.rounds)

    def solve(self, problem: Problem) -> Estimate:
        """Return the estimate of the weighted rows."""
        return Estimate.of_fit(problem, problem.scaled_factors.fit(self.rounds), scaled=True)


@dataclass(frozen=True)
class GeneralizedLeastSquares(AbstractEstimator):
    """Generalized least squares (GLS), X = argmin (Y - W X)' C^-1 (Y - W X), with C the covariance that noise gives the rows.

    Noise of an encoder, twice differentiated, grows with the square of the frequency, and rows share that of neighbouring
    instants and other joints. Weighted least squares takes them for independent, and leaves a factor of four. C follows from
    the noise of each joint's torque and position (`NoisyRows`), whose levels make the explicit model's rows most likely
    (`likely_levels`). What noise of the positions adds to W on average is taken from it (`unbiased`). Rows of a model that
    multiplies torques by something that varies, such as the power model, have two independent errors beside that, as large as
    makes them most likely: one that is white, and what noise makes of friction where joints hardly move.
    """

    acronym: ClassVar[str] = "GLS"
    needs: ClassVar[frozenset[Need]] = frozenset({"factors"})
    takes_prior: ClassVar[bool] = True

    def solve(self, problem: Problem) -> Estimate:
        """Return the estimate; of logs too long for their rows to be kept, pieces count as independent."""
        require_torques_once(problem.model, problem.basis.n)
        R = problem.independent_factor
        known = None if problem.prior is None else prior_rows(problem.prior, R, np.ones(R.shape[:-2]))
        factor = Factor(R, problem.factors.together.rows, problem.names, known)
        if R.ndim == 2 and problem.factors.together.status == Status.OK:
            factor.check()  # without what noise adds to W, less may be determined
        solvable = (problem.factors.together.status == Status.OK) & factor.determined
        inverse = factor.inverse(solvable)
        return Estimate(problem, frozen(factor.solution(solvable)), frozen(inverse), OfWhitenedRows(inverse, known))
