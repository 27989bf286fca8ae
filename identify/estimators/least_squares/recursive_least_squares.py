"""Recursive least squares: the estimate as the rows come in, and one that forgets."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from idbench.identify.arrays import Array, frozen
from idbench.identify.errors import IdentificationError, require_positive
from idbench.identify.estimators.estimate import Estimate
from idbench.identify.estimators.estimator import AbstractEstimator
from idbench.identify.estimators.problem import Problem
from idbench.identify.estimators.simulating.row_products import Kinds, covariance_by, solve_with, with_weights
from idbench.identify.estimators.solution import Given
from idbench.identify.rows.factors import Factor, Status


@dataclass(frozen=True)
class RecursiveLeastSquares(AbstractEstimator):
    """Recursive least squares (RLS) that forgets: its last estimate, as a controller has it that adapts while it moves.

    Rows count exp(-(T - t) / memory), T being the end of the log, and by the residuals of their joint as in weighted least
    squares, which it is for an endless memory. What it forgets it pays with variance.
    """

    acronym: ClassVar[str] = "RLS"

    memory: float = 10.0
    """Time [s] after which a row counts a third."""

    def __post_init__(self) -> None:
        require_positive(memory=self.memory)

    def solve(self, problem: Problem) -> Estimate:
        """Return the estimate at the end of the last log."""
        rows, kinds = problem.rows, Kinds.of_rows(problem)
        ages, later = list[Array](), 0.0
        for part in reversed(rows.maps):
            ages.insert(0, np.repeat(part.time[-1] - part.time, rows.kinds) + later)
            later += float(part.time[-1] - part.time[0])
        every = solve_with(kinds, rows.Y, rows.W, rows.W)
        even = kinds.weights(every.residual)
        weight = even * np.exp(-np.concatenate(ages) / (2 * self.memory))
        found = with_weights(rows.Y, rows.W, weight)
        covariance = covariance_by(even, found.G, found.residual)
        return Estimate(problem, frozen(found.X), frozen(covariance), Given(found.G, weight))


@dataclass(frozen=True, eq=False)
class Recursive:
    """An estimate over time; NaN as long as the rows do not determine every parameter."""

    t: Array
    """Shape (instant,) [s]."""
    X: Array
    """Parameters, as far as the rows that are final at `t` determine them, shape (instant, p)."""
    sigma: Array
    """Their standard errors, shape (instant, p)."""


def recursive_least_squares(estimate: Estimate, t: Array, halo: float = 0.0) -> Recursive:
    """Return the estimate from the rows that were final at each instant, by one triangular factor that takes in row by row.

    The rows are made independent as for the estimate itself, each by those before it, so that the last of it is that estimate.
    Sigma is that of section 7.3 for the rows so far, in the ratio to that of all rows in which the estimate's sigma is.

    Parameters
    ----------
    estimate : Estimate
        A least-squares estimate of a single run.
    t : Array, shape (instant,)
        Increasing [s].
    halo : float
        How long after its time a row is final [s], such as `Chain.halo`.

    Raises
    ------
    IdentificationError
        If the estimate is not that of a single run of one log, no least-squares solution, or its log too long for its rows to
        be kept; if the instants decrease.
    """
    if (rows := estimate.independent_rows()) is None or estimate.X.ndim > 1 or len(estimate.problem.logs) > 1:
        raise IdentificationError("recursive least squares needs the rows of a least-squares estimate of one run of one log")
    if len(t) and np.diff(t, prepend=t[0]).min() < 0:
        raise IdentificationError("the instants of recursive least squares must not decrease: sort them")
    given = estimate.rows
    valid = np.cumsum(np.append(0, given.valid))
    until = np.append(np.searchsorted(given.time + halo, t, side="right"), len(given.time))
    p, before = len(estimate.names), 0
    R = np.zeros((len(until) + 1, p + 1, p + 1))
    for k, now in enumerate(until):
        R[k + 1] = np.linalg.qr(np.concatenate([R[k], rows[before:now]]), mode="r")
        before = int(now)
    factor = Factor(R[1:], valid[until], estimate.names)
    solvable = factor.status == Status.OK
    X = factor.solution(solvable)
    variance = factor.squares(X) / np.maximum(factor.rows - p, 1)
    sigma = np.sqrt(variance[:, None] * np.diagonal(factor.inverse(solvable), axis1=-2, axis2=-1))
    return Recursive(t, X[:-1], sigma[:-1] * estimate.standard_errors / sigma[-1])
