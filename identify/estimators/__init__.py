"""Estimators, and their table."""

from idbench.identify.estimators.estimate import Estimate as Estimate
from idbench.identify.estimators.estimator import AbstractEstimator as AbstractEstimator
from idbench.identify.estimators.least_squares.iteratively_reweighted import IterativelyReweighted as IterativelyReweighted
from idbench.identify.estimators.least_squares.ordinary_weighted_generalized import (
    GeneralizedLeastSquares as GeneralizedLeastSquares,
)
from idbench.identify.estimators.least_squares.ordinary_weighted_generalized import OrdinaryLeastSquares as OrdinaryLeastSquares
from idbench.identify.estimators.least_squares.ordinary_weighted_generalized import WeightedLeastSquares as WeightedLeastSquares
from idbench.identify.estimators.least_squares.recursive_least_squares import RecursiveLeastSquares as RecursiveLeastSquares
from idbench.identify.estimators.least_squares.selected_rows import SelectedRows as SelectedRows
from idbench.identify.estimators.least_squares.total_least_squares import TotalLeastSquares as TotalLeastSquares
from idbench.identify.estimators.likelihood.kalman_filter import UnscentedKalmanFilter as UnscentedKalmanFilter
from idbench.identify.estimators.likelihood.maximum_likelihood import MaximumLikelihood as MaximumLikelihood
from idbench.identify.estimators.likelihood.maximum_likelihood import with_delay, with_reversals
from idbench.identify.estimators.problem import Problem as Problem
from idbench.identify.estimators.simulating.closed_loops import ClosedLoopInputError as ClosedLoopInputError
from idbench.identify.estimators.simulating.closed_loops import ClosedLoopOutputError as ClosedLoopOutputError
from idbench.identify.estimators.simulating.closed_loops import DirectInverse as DirectInverse
from idbench.identify.estimators.simulating.closed_loops import InstrumentalVariables as InstrumentalVariables
from idbench.identify.estimators.simulating.output_error import OutputError as OutputError
from idbench.identify.plugins import PluginTable

ESTIMATORS: PluginTable[AbstractEstimator] = PluginTable(
    "estimators",
    AbstractEstimator,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {
        "OLS": OrdinaryLeastSquares,
        "OLS-selected": SelectedRows,
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
