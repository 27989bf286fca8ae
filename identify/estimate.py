"""What comes out of an identification, and how good it is."""

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
import numpy.typing as npt

from identify.arrays import Array, frozen
from identify.system import Status, System


@dataclass(frozen=True, eq=False, repr=False)
class Estimate:
    """Parameters with their uncertainty, judged on the rows they came from. Leading axes are independent runs.

    Parameters
    ----------
    system : System
        Y and W.
    X : Array, shape (..., p)
        Estimated parameters; NaN where the system's status is not OK.
    covariance : Array, shape (..., p, p)
        Covariance of the error of X, as the estimator has it: as if rows were independent.
    solved : System, optional
        The rows, as they were weighted, whose least-squares solution X is; without them there is no corrected sigma.
    correction : Array, shape (..., p), optional
        Corrected over uncorrected sigma, where it is known from a part of the rows.
    """

    system: System
    X: Array
    covariance: Array
    solved: System | None
    correction: Array | None = None

    @classmethod
    def judge(
        cls,
        system: System,
        X: npt.ArrayLike,
        covariance: npt.ArrayLike | None = None,
        *,
        solved: System | None = None,
    ) -> Self:
        """Return the estimate X of a system.

        Without a `covariance` that of section 7.3 is used: sigma_rho^2 (W' W)^-1 with sigma_rho^2 = |Y - W X|^2 / (r - p),
        of the rows as they were weighted. An estimator whose X is a least-squares solution hands in the rows that it `solved`.
        """
        x = frozen(X)
        return cls(system, x, frozen(_paper_covariance(solved or system, x) if covariance is None else covariance), solved)

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of X."""
        return self.system.parameters

    @property
    def sigma(self) -> Array:
        """Standard deviation of every parameter, shape (..., p)."""
        return np.sqrt(np.diagonal(self.covariance, axis1=-2, axis2=-1))

    @cached_property
    def corrected_covariance(self) -> Array:
        """Covariance of the error of X that white noise of the torques makes, shape (..., p, p); NaN if it is not known.

        X = G' Y with G = W (W' W)^-1 of the rows as they were solved, and each row is a sum over the torque samples of a log
        (`Carrier`). So X is such a sum too, and its covariance is sum_j sigma_j^2 H_j H_j' with H_j the weights of the torque
        of joint j: rows may overlap, be weighted or multiplied by velocities, and joints may differ.
        """
        if self.correction is not None:
            return self.covariance * self.correction[..., None] * self.correction[..., None, :]
        solved, p = self.solved, len(self.parameters)
        total = np.zeros(self.covariance.shape)
        if solved is None or solved.levels is None or not solved.carriers:
            return np.full(total.shape, np.nan)
        inverse = _inverse(solved)
        G = np.matmul(solved.W, np.matmul(inverse, np.swapaxes(inverse, -1, -2)))
        if solved.weight is not None:
            G *= solved.weight[..., None]
        first = 0
        for carrier in solved.carriers:
            for joint, H in carrier.pull(G[..., first : first + carrier.rows, :]).items():
                total += solved.levels[..., joint, None, None] ** 2 * np.matmul(H, np.swapaxes(H, -1, -2))
            first += carrier.rows
        return np.where((solved.status == Status.OK)[..., None, None], total, np.full((p, p), np.nan))

    @property
    def corrected_sigma(self) -> Array:
        """Standard deviation of every parameter, from `corrected_covariance`, shape (..., p)."""
        return np.sqrt(np.diagonal(self.corrected_covariance, axis1=-2, axis2=-1))

    @property
    def best_covariance(self) -> Array:
        """The corrected covariance, or the estimator's own where that is not known, shape (..., p, p)."""
        known = np.isfinite(self.corrected_covariance).all(axis=(-2, -1), keepdims=True)
        return np.where(known, self.corrected_covariance, self.covariance)

    @property
    def relative_sigma_percent(self) -> Array:
        """%sigma of section 7.3, 100 sigma / |X|, shape (..., p)."""
        return 100 * self.sigma / np.abs(self.X)

    @property
    def rows(self) -> npt.NDArray[np.intp]:
        """Number of rows that are not void, r, shape (...)."""
        return self.system.rows

    @cached_property
    def predicted(self) -> Array:
        """W X, shape (..., r)."""
        return _predicted(self.system, self.X)

    @property
    def residual(self) -> Array:
        """rho = Y - W X, shape (..., r)."""
        return self.system.Y - self.predicted

    @property
    def residual_rms(self) -> Array:
        """Root mean square of the residual over the rows that are not void, shape (...)."""
        return np.sqrt(np.sum(self.residual**2, axis=-1) / np.maximum(self.rows, 1))

    @property
    def condition_number(self) -> Array:
        """Cond(W), shape (...)."""
        return self.system.condition_number

    def __str__(self) -> str:
        if self.X.ndim > 1:
            return f"estimates of {', '.join(self.parameters)} in {self.X.shape[:-1]} runs"
        lines = [f"{'':8}{'X':>12}{'sigma':>12}{'%sigma':>9}"]
        values = zip(self.parameters, self.X, self.sigma, self.relative_sigma_percent, strict=True)
        lines += [f"{name:8}{x:12.5g}{s:12.2g}{percent:9.2g}" for name, x, s, percent in values]
        return "\n".join(
            [*lines, f"Cond(W) = {self.condition_number:.1f}, {self.rows} rows, residual rms {self.residual_rms:.3g}"]
        )

    def error_percent(self, truth: npt.ArrayLike) -> Array:
        """Return 100 (X - truth) / |truth|, shape (..., p); NaN where the truth is 0."""
        true = np.asarray(truth, dtype=np.float64)
        return 100 * (self.X - true) / np.where(true == 0, np.nan, np.abs(true))

    def relative_error_percent(self, truth: npt.ArrayLike) -> Array:
        """Return 100 |X - truth| / |truth|, shape (..., p), the paper's %e; NaN where the truth is 0."""
        return np.abs(self.error_percent(truth))


def _paper_covariance(system: System, X: Array) -> Array:
    """Return sigma_rho^2 (W' W)^-1 (section 7.3), NaN where the system cannot be solved."""
    ok, inverse = (system.status == Status.OK)[..., None, None], _inverse(system)
    freedom = np.maximum(system.rows - len(system.parameters), 1)
    variance = np.sum((system.Y - _predicted(system, X)) ** 2, axis=-1) / freedom
    return np.where(ok, variance[..., None, None] * np.matmul(inverse, np.swapaxes(inverse, -1, -2)), np.nan)


def _inverse(system: System) -> Array:
    """Return R^-1, shape (..., p, p); that of ones where W has not full rank."""
    ok = (system.status == Status.OK)[..., None, None]
    return np.linalg.inv(np.where(ok, system.R_W, np.eye(len(system.parameters))))


def _predicted(system: System, X: Array) -> Array:
    return np.matmul(system.W, X[..., None])[..., 0]
