"""What comes out of an identification, and how good it is."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

import numpy as np
import numpy.typing as npt

from idbench.identify.arrays import Array, frozen
from idbench.identify.errors import PluginError
from idbench.identify.estimators.leave_out import BetweenLogs, ModelError, between_logs
from idbench.identify.estimators.likelihood.joint_fit import JointFit
from idbench.identify.estimators.log_rows import bias_covariance, delay_covariance, noise_covariance
from idbench.identify.estimators.problem import Problem
from idbench.identify.estimators.solution import AbstractSolution, Given, OfWeightedRows, OfWhitenedRows
from idbench.identify.noise.propagation import NoiseLevels
from idbench.identify.rows.factors import Factor, LeastSquaresFit, Status
from idbench.identify.rows.rows import Rows
from idbench.identify.tables import concise, html_table, text_table


@dataclass(frozen=True, eq=False, repr=False)
class Estimate:
    """Parameters with their uncertainty, judged on the rows they came from. Leading axes are independent runs."""

    problem: Problem
    """Logs, robot, model and rows."""
    X: Array
    """Estimated parameters; NaN where the rows cannot be solved, shape (..., p)."""
    own_covariance: Array
    """Covariance of the error of X as the estimator computes it; OLS and WLS assume independent rows (section 7.3), shape (...,
    p, p)."""
    solution: AbstractSolution | None = None
    """How X follows from the rows; without it standard errors are the estimator's own."""
    calibrated: Array | None = None
    """Covariance of the error of X due to the noise of the logs, if the estimator knows it; by default from `solution`, shape
    (..., p, p), optional."""
    levels: NoiseLevels | None = None
    """The noise of the logs as the estimator found it; by default that of the problem."""
    fits: Mapping[tuple[int, ...], JointFit] = field(default_factory=dict)
    """For `ML`: fitted motion and parameters of each solved run, by its index; key () if there is one run."""
    failures: Mapping[tuple[int, ...], str] = field(default_factory=dict)
    """Reasons, other than rank deficiency, why a run has no estimate."""
    path: tuple[Array, ...] = ()
    """Iterates of iterative estimators, the start first, shape (..., p)."""
    simulations: npt.NDArray[np.intp] | None = None
    """How often the robot was simulated, shape (...)."""

    @classmethod
    def judge(
        cls, problem: Problem, X: npt.ArrayLike, covariance: npt.ArrayLike | None = None, *, influence: Array | None = None
    ) -> Self:
        """Return the estimate X of a problem.

        Parameters
        ----------
        problem : Problem
            As it was given to the estimator.
        X : array_like, shape (..., p)
            The estimate.
        covariance : array_like, shape (..., p, p), optional
            That of section 7.3 by default: sigma_rho^2 (W' W)^-1 with sigma_rho^2 = |Y - W X|^2 / (r - p).
        influence : Array, shape (..., r, p), optional
            G with which X = G' Y to first order: what the estimate changes by if a row of Y, or the error of a row, does. It
            is what standard errors are computed from.
        """
        shape, p = problem.factors.together.status.shape, len(problem.names)
        x = _real_array("X", X, (*shape, p))
        solution = None
        if influence is not None:
            solution = Given(_real_array("influence", influence, (*shape, len(problem.rows.time), p)))
        if covariance is None:
            return cls(problem, x, frozen(_paper_covariance(problem.factors.together, x)), solution)
        return cls(problem, x, _real_array("covariance", covariance, (*shape, p, p)), solution)

    @classmethod
    def of_fit(cls, problem: Problem, fit: LeastSquaresFit, *, scaled: bool) -> Self:
        """Return the estimate of a least-squares solution; `scaled` if its rows were divided by their noise."""
        inverse = fit.factor.inverse(problem.factors.together.status == Status.OK)
        covariance = _paper_covariance(fit.factor, fit.X, inverse)
        return cls(
            problem,
            frozen(fit.X),
            frozen(covariance),
            OfWeightedRows(fit.weight, inverse, scaled, fit.factor.prior, fit.factor.noise),
        )

    def __repr__(self) -> str:
        return text_table(*self._table())

    def _repr_html_(self) -> str:
        return html_table(*self._table())

    def _table(self) -> tuple[str, list[str], list[list[str]]]:
        """Return title, heads and rows of what is shown of it: of several runs the first."""
        several = self.X.ndim > 1
        X, sigma = (x.reshape(-1, x.shape[-1])[0] for x in (self.X, self.standard_errors))
        of = f", the first of {self.X.size // max(self.X.shape[-1], 1)} runs" if several else ""
        units = self.problem.basis.units
        rows = [[name, concise(x, s), unit] for name, x, s, unit in zip(self.names, X, sigma, units, strict=True)]
        return f"{len(self.names)} parameters{of}", ["", "value", "unit"], rows

    @property
    def names(self) -> tuple[str, ...]:
        """Names of X."""
        return self.problem.names

    @property
    def rows(self) -> Rows:
        """The rows it came from; raise IdentificationError if they were too many to be kept."""
        return self.problem.rows

    @property
    def own_sigma(self) -> Array:
        """Standard error of every parameter, as the estimator has it, shape (..., p)."""
        return _roots(self.own_covariance)

    @cached_property
    def calibrated_covariance(self) -> Array:
        """Covariance of the error of X due to the noise of the logs, shape (..., p, p); NaN if it is not known.

        X = G' Y, and each row is a linear function of the samples of a log, whose torques and positions are noisy. So X is such
        a function, too: rows may overlap, be weighted or multiplied by velocities, and joints may differ.
        """
        if self.calibrated is not None:
            return self.calibrated
        if self.solution is None:
            return np.full(self.own_covariance.shape, np.nan)
        influence = self.solution.influence(self.problem.parts)
        found = noise_covariance(self.problem, influence) + bias_covariance(self.problem, influence) + self.solution.of_prior
        return np.where((self.status == Status.OK)[..., None, None], found, np.nan)

    def influence(self) -> Array | None:
        """Return G of all rows, with which X = G' Y to first order, shape (..., r, p), if it is known."""
        return None if self.solution is None else np.concatenate(self.solution.influence(self.problem.parts), axis=-2)

    def independent_rows(self) -> Array | None:
        """Return [W Y] made independent, shape (..., r, p + 1), if X is the least-squares solution of such rows."""
        found = None if self.solution is None else self.solution.independent(self.problem.parts)
        return None if found is None else np.concatenate(found, axis=-2)

    @property
    def noise_levels(self) -> NoiseLevels:
        """Standard deviations of the noise in torques and positions, on which standard errors are based."""
        return self.levels or self.problem.noise

    @property
    def calibrated_sigma(self) -> Array:
        """Standard error of every parameter, from `calibrated_covariance`, shape (..., p)."""
        return _roots(self.calibrated_covariance)

    @cached_property
    def covariance(self) -> Array:
        """Covariance of the error of X due to noise, delay and the model, shape (..., p, p)."""
        scatter = 0.0 if self.model_error is None else self.model_error.scatter[..., None] * np.eye(len(self.names))
        return self.within_covariance + scatter

    @property
    def within_covariance(self) -> Array:
        """The same without the scatter from log to log, which is not known of combinations, shape (..., p, p)."""
        return self.noise_covariance + (0.0 if self.model_error is None else self.model_error.covariance)

    @property
    def noise_covariance(self) -> Array:
        """Covariance of the error of X due to noise and delay, by the estimator where noise is not known, shape (..., p, p)."""
        known = np.isfinite(self.calibrated_covariance).all(axis=(-2, -1), keepdims=True)
        return np.where(known, self.calibrated_covariance, self.own_covariance) + self.delay_covariance

    @cached_property
    def model_error(self) -> ModelError | None:
        """The error of X due to the model, beyond that of noise; None where it is not known how X follows from rows."""
        if self.solution is None:
            return None
        parts, noise = self.problem.parts, np.diagonal(self.noise_covariance, axis1=-2, axis2=-1)
        found = ModelError.of(parts, self.X, self.solution.influence(parts), self.problem.share, noise)
        between = self.between_logs
        return found if between is None else replace(found, scatter=between.variance / between.logs)

    @cached_property
    def between_logs(self) -> BetweenLogs | None:
        """How much parameters move from log to log; None where there is one log, or many runs, or rows are not kept."""
        several = len(self.problem.logs) > 1 and self.X.ndim == 1 and not self.problem.long
        if not (several and isinstance(self.solution, OfWeightedRows | OfWhitenedRows)):
            return None
        return between_logs(self.problem.parts, self.solution)

    @property
    def knows_delay(self) -> bool:
        """Whether standard errors contain that of the delay: it is known how X follows from the rows, and these are kept."""
        return self.solution is not None and not self.problem.long

    @cached_property
    def delay_covariance(self) -> Array:
        """Covariance of the error of X due to that of the delays, shape (..., p, p); 0 where it is not known."""
        if self.solution is None or self.problem.long or not any(log.torque.delay_sigma for log in self.problem.logs):
            return np.zeros(self.own_covariance.shape)
        return delay_covariance(self.problem.parts, self.solution.influence(self.problem.parts))

    @property
    def standard_errors(self) -> Array:
        """Standard error (sigma) of every parameter, from `covariance`, shape (..., p)."""
        return _roots(self.covariance)

    @property
    def noise_sigma(self) -> Array:
        """The part of every standard error due to noise and delay, shape (..., p)."""
        return _roots(self.noise_covariance)

    @property
    def paper_sigma_percent(self) -> Array:
        """%sigma of section 7.3, 100 sigma / |X| with the estimator's own sigma, shape (..., p)."""
        zero = self.X == 0
        return np.where(zero, np.inf, 100 * self.own_sigma / np.where(zero, 1.0, np.abs(self.X)))

    @property
    def status(self) -> npt.NDArray[np.intp]:
        """Whether the rows of every run can be solved for X, shape (...)."""
        return self.problem.factors.together.status

    @property
    def row_count(self) -> npt.NDArray[np.intp]:
        """Number of rows that are not void, r, shape (...)."""
        return self.problem.factors.together.rows

    @property
    def condition_number(self) -> Array:
        """Cond(W), shape (...)."""
        return self.problem.factors.together.condition_number

    @cached_property
    def predicted(self) -> Array:
        """W X, shape (..., r)."""
        return self.rows.predicted(self.X)

    @property
    def residual(self) -> Array:
        """rho = Y - W X, shape (..., r)."""
        return self.rows.Y - self.predicted

    @property
    def residual_rms(self) -> Array:
        """Root mean square of the residual over the rows that are not void, shape (...)."""
        return np.sqrt(self.problem.factors.together.squares(self.X) / np.maximum(self.row_count, 1))

    def error_percent(self, truth: npt.ArrayLike) -> Array:
        """Return 100 (X - truth) / |truth|, shape (..., p); NaN where the truth is 0."""
        true = np.asarray(truth, dtype=np.float64)
        return 100 * (self.X - true) / np.where(true == 0, np.nan, np.abs(true))

    def relative_error_percent(self, truth: npt.ArrayLike) -> Array:
        """Return 100 |X - truth| / |truth|, shape (..., p), the paper's %e; NaN where the truth is 0."""
        return np.abs(self.error_percent(truth))


def _real_array(name: str, values: npt.ArrayLike, shape: tuple[int, ...]) -> Array:
    """An estimator's result as an array; raise PluginError if it has no real numbers, or not as many."""
    given = np.asarray(values)
    if given.dtype.kind not in "fiub" or given.shape != shape:
        raise PluginError(
            f"Estimate.judge is given {name} of {given.dtype}, shape {given.shape}; it takes real numbers, shape {shape}: one "
            "for each of problem.names"
        )
    return frozen(given)


def _paper_covariance(factor: Factor, X: Array, inverse: Array | None = None) -> Array:
    """Return sigma_rho^2 (W' W)^-1 (section 7.3), NaN where the rows cannot be solved."""
    inverse = factor.inverse(factor.status == Status.OK) if inverse is None else inverse
    freedom = np.maximum(factor.rows - factor.p, 1)
    return (factor.squares(X) / freedom)[..., None, None] * inverse


def _roots(covariance: Array) -> Array:
    return np.sqrt(np.diagonal(covariance, axis1=-2, axis2=-1))
