"""Estimators, and their table."""

from identify.estimators.estimate import Estimate as Estimate
from identify.estimators.estimator import AbstractEstimator as AbstractEstimator
from identify.estimators.least_squares.generalized_least_squares import (
    GeneralizedLeastSquares as GeneralizedLeastSquares,
)
from identify.estimators.least_squares.iteratively_reweighted import IterativelyReweighted as IterativelyReweighted
from identify.estimators.least_squares.ordinary_least_squares import (
    OrdinaryLeastSquares as OrdinaryLeastSquares,
)
from identify.estimators.least_squares.recursive_least_squares import RecursiveLeastSquares as RecursiveLeastSquares
from identify.estimators.least_squares.total_least_squares import TotalLeastSquares as TotalLeastSquares
from identify.estimators.least_squares.weighted_least_squares import (
    WeightedLeastSquares as WeightedLeastSquares,
)
from identify.estimators.likelihood.kalman_filter import UnscentedKalmanFilter as UnscentedKalmanFilter
from identify.estimators.likelihood.maximum_likelihood import (
    MaximumLikelihood as MaximumLikelihood,
)
from identify.estimators.likelihood.maximum_likelihood import with_delay, with_reversals
from identify.estimators.problem import Problem as Problem
from identify.estimators.simulating.closed_loop_input_error import ClosedLoopInputError as ClosedLoopInputError
from identify.estimators.simulating.closed_loop_output_error import ClosedLoopOutputError as ClosedLoopOutputError
from identify.estimators.simulating.direct_inverse import DirectInverse as DirectInverse
from identify.estimators.simulating.instrumental_variables import InstrumentalVariables as InstrumentalVariables
from identify.estimators.simulating.output_error import OutputError as OutputError
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
        "ML-reversals": with_reversals,
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
