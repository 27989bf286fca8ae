"""Estimators, and their table."""

from identify.estimators.closed_loop_input_error import ClosedLoopInputError as ClosedLoopInputError
from identify.estimators.closed_loop_output_error import ClosedLoopOutputError as ClosedLoopOutputError
from identify.estimators.direct_inverse import DirectInverse as DirectInverse
from identify.estimators.estimate import Estimate as Estimate
from identify.estimators.estimator import AbstractEstimator as AbstractEstimator
from identify.estimators.generalized_least_squares import (
    GeneralizedLeastSquares as GeneralizedLeastSquares,
)
from identify.estimators.instrumental_variables import InstrumentalVariables as InstrumentalVariables
from identify.estimators.iteratively_reweighted import IterativelyReweighted as IterativelyReweighted
from identify.estimators.kalman_filter import UnscentedKalmanFilter as UnscentedKalmanFilter
from identify.estimators.maximum_likelihood import (
    MaximumLikelihood as MaximumLikelihood,
)
from identify.estimators.maximum_likelihood import with_delay
from identify.estimators.ordinary_least_squares import (
    OrdinaryLeastSquares as OrdinaryLeastSquares,
)
from identify.estimators.output_error import OutputError as OutputError
from identify.estimators.problem import Problem as Problem
from identify.estimators.recursive_least_squares import RecursiveLeastSquares as RecursiveLeastSquares
from identify.estimators.total_least_squares import TotalLeastSquares as TotalLeastSquares
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
        "IRLS": IterativelyReweighted,
        "TLS": TotalLeastSquares,
        "RLS": RecursiveLeastSquares,
        "IV": InstrumentalVariables,
        "DIDIM": DirectInverse,
        "CLIE": ClosedLoopInputError,
        "CLOE": ClosedLoopOutputError,
        "OE": OutputError,
        "UKF": UnscentedKalmanFilter,
    },
    check=AbstractEstimator.require_needs,
)
