"""Estimators, and their table."""

from identify.estimators.estimate import Estimate as Estimate
from identify.estimators.estimator import AbstractEstimator as AbstractEstimator
from identify.estimators.generalized_least_squares import (
    GeneralizedLeastSquares as GeneralizedLeastSquares,
)
from identify.estimators.maximum_likelihood import (
    MaximumLikelihood as MaximumLikelihood,
)
from identify.estimators.maximum_likelihood import with_delay
from identify.estimators.ordinary_least_squares import (
    OrdinaryLeastSquares as OrdinaryLeastSquares,
)
from identify.estimators.problem import Problem as Problem
from identify.estimators.weighted_least_squares import (
    WeightedLeastSquares as WeightedLeastSquares,
)
from identify.plugins import PluginTable

ESTIMATORS: PluginTable[AbstractEstimator] = PluginTable(
    "estimators",
    AbstractEstimator,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {
        "OLS": OrdinaryLeastSquares,
        "WLS": WeightedLeastSquares,
        "GLS": GeneralizedLeastSquares,
        "ML": MaximumLikelihood,
        "ML-delay": with_delay,
    },
)
