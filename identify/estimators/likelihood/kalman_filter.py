"""Unscented Kalman filter of states and parameters."""

from contextlib import suppress
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from idbench.identify.arrays import HELD, Array, frozen
from idbench.identify.basis.basis import Basis
from idbench.identify.errors import IdentificationError, require_positive
from idbench.identify.estimators.estimate import Estimate
from idbench.identify.estimators.estimator import AbstractEstimator, Need
from idbench.identify.estimators.likelihood.cells import Cells
from idbench.identify.estimators.likelihood.joint_fit import MASK, UNKNOWN
from idbench.identify.estimators.problem import Problem
from idbench.identify.estimators.simulating.simulated_rounds import small_steps, starting_point
from idbench.identify.models import ExplicitModel
from idbench.identify.noise.linearization import friction_jumps
from idbench.identify.noise.propagation import NoiseLevels
from idbench.identify.rows.factors import Status
from idbench.identify.signals.signals import State

ALPHA, BETA = 0.1, 2.0
"""Spread of the sigma points, and 2 for normal distributions (E. A. Wan and R. van der Merwe, "The unscented Kalman filter for
nonlinear estimation", Proc. IEEE AS-SPCC 2000, 153-158)."""

TUNINGS = 1.0, 3.0, 10.0  # Process noise that is tried, over the torque noise of the log
MIN_NOISE = 1e-7  # Noise of positions [rad] and torques [N m] at least: of exact ones covariances would be those of rounding

UNSURE = 10.0
"""Uncertainty of a parameter at the beginning at least, in steps that make 0.1 % of the torque: those that begin at zero."""

FASTEST = 100.0  # Uncertainty of the first velocity [rad/s] at most


@dataclass(frozen=True)
class UnscentedKalmanFilter(AbstractEstimator):
    """Unscented Kalman filter (UKF) of positions, velocities and parameters together, one pass over the log.

    The state moves by the robot's equation, driven by the logged torques, and its parameters not at all. Noise of the torques
    is process noise; where the sign of a velocity says nothing of friction, it is as large as that. Its size is what makes the
    innovations most likely, among some multiples of the noise that the log shows. The chain says where it begins, and how large
    noise is; the filter of rows takes no part.
    """

    acronym: ClassVar[str] = "UKF"
    needs: ClassVar[frozenset[Need]] = frozenset({"rows", "logs"})
    begins: ClassVar[bool] = True
    filtered: ClassVar[bool] = False

    spread: float = 0.15
    """Standard deviation of every parameter at the beginning, as a share of its value."""

    def __post_init__(self) -> None:
        require_positive(spread=self.spread)

    def solve(self, problem: Problem) -> Estimate:
        """Return the estimate of every run.

        Raises
        ------
        IdentificationError
            If the model is not the explicit one, or the filter diverges in every run.
        """
        if not isinstance(problem.model, ExplicitModel):
            raise IdentificationError(
                "UKF has the robot's equation, not rows: it has the explicit model alone (--model explicit)"
            )
        if problem.basis.is_nonlinear or any(log.conditions for log in problem.logs):
            raise IdentificationError("UKF knows friction of the velocity alone: use GLS for laws of load or temperature")
        start, h = starting_point(problem), small_steps(problem)
        sigma = np.maximum(self.spread * np.abs(start), UNSURE * h)
        runs, p = start.shape[:-1], start.shape[-1]
        X = np.full((*runs, p), np.nan)
        covariance = np.full((*runs, p, p), np.nan)
        failures = dict[tuple[int, ...], str]()
        torque = np.zeros((*runs, problem.basis.n))
        levels = problem.likely_noise
        for run in np.ndindex(runs):
            if problem.factors.together.status[run] != Status.OK or not np.isfinite(start[run]).all():
                continue
            own = NoiseLevels(np.maximum(np.nan_to_num(levels.torque[run]), MIN_NOISE), problem.position_noise[run])
            found = []
            for tuning in TUNINGS:
                with suppress(np.linalg.LinAlgError):  # it diverges
                    found.append(_filtered(problem, run, start[run], sigma[run], own, tuning))
            if not found:
                failures[run] = "the filter diverges from this start: start closer to the true parameters, or with less spread"
                continue
            best = max(found, key=lambda each: each[0])
            _, X[run], covariance[run], torque[run] = best
        if failures and len(failures) == X[..., 0].size:
            raise IdentificationError(next(iter(failures.values())))
        calibrated = frozen(covariance)
        noise = NoiseLevels(torque, problem.position_noise)
        return Estimate(problem, frozen(X), calibrated, calibrated=calibrated, levels=noise, failures=failures, path=(start, X))


def _filtered(
    problem: Problem, run: tuple[int, ...], X: Array, sigma: Array, noise: NoiseLevels, tuning: float
) -> tuple[float, Array, Array, Array]:
    """Return log likelihood, parameters, their covariance and the torque noise of a pass over the logs of a run."""
    likelihood, P = 0.0, np.diag(np.ones(len(X)))
    state, level = X.copy(), noise.torque * tuning
    for whole, signals in zip(problem.logs, problem.signals, strict=True):
        log = whole.run(run)
        weight = MASK.weight(signals.state.qd[run], log.fs)
        unknown = UNKNOWN * friction_jumps(problem.basis, X, log.q[0])
        variance = (level[:, None] + (1 - weight) * unknown[:, None]) ** 2
        at = np.arange(log.samples) - log.torque.delay * log.fs
        tau = np.stack([np.interp(at, np.arange(len(x)), x) for x in Cells.of(log).torque[0]])  # mean from sample to sample
        one = _Filter(problem.basis, tau, log.fs, variance, np.maximum(noise.position, MIN_NOISE))
        more, state, P = one.run(log.q, state, P, sigma)
        likelihood += more
    return likelihood, state, P * np.outer(sigma, sigma), level


@dataclass(frozen=True, eq=False)
class _Filter:
    basis: Basis
    tau: Array
    fs: float
    variance: Array
    position: Array

    def run(self, q: Array, X: Array, P_X: Array, sigma: Array) -> tuple[float, Array, Array]:
        """Return log likelihood, parameters and their covariance, in units of sigma, after a log."""
        n, p = q.shape[-1], len(X)
        z = np.concatenate([q[0], np.zeros(n), X / sigma])
        P = np.zeros((2 * n + p, 2 * n + p))
        velocity = np.minimum(np.abs(q[1] - q[0]) * self.fs + 10 * self.position * self.fs, FASTEST)
        P[:n, :n], P[n : 2 * n, n : 2 * n] = np.diag(self.position**2), np.diag(velocity**2)
        P[2 * n :, 2 * n :] = P_X
        likelihood, R = 0.0, np.diag(self.position**2)
        for k in range(len(q)):
            S = P[:n, :n] + R
            root = np.linalg.cholesky(S)
            gain = np.linalg.solve(S, P[:n]).T
            e = np.linalg.solve(root, q[k] - z[:n])
            likelihood -= float(e @ e) / 2 + float(np.log(np.diag(root)).sum())
            z = z + gain @ (q[k] - z[:n])
            P = P - gain @ S @ gain.T
            P = (P + P.T) / 2
            if k + 1 < len(q):
                z, P = self._moved(k, z, P, sigma)
        if not np.isfinite(z).all():
            raise np.linalg.LinAlgError("not finite")
        return likelihood, z[2 * n :] * sigma, P[2 * n :, 2 * n :]

    def _moved(self, k: int, z: Array, P: Array, sigma: Array) -> tuple[Array, Array]:
        """Return state and covariance a sample later."""
        n, size = self.basis.n, len(z)
        root = ALPHA * np.sqrt(size) * np.linalg.cholesky(P + 1e-14 * np.diag(np.diag(P)))
        points = np.concatenate([z[:, None], z[:, None] + root, z[:, None] - root], axis=1)
        moved, push = self._step(k, points, sigma)
        off = moved[:, 1:] - moved[:, :1]
        weight = 1 / (2 * size * ALPHA**2)
        mean = weight * off.sum(axis=1)
        P = weight * (off @ off.T) + (BETA - ALPHA**2) * np.outer(mean, mean)
        Q = (push * self.variance[:, k]) @ push.T
        P[: 2 * n, : 2 * n] += Q
        return moved[:, 0] + mean, P

    def _step(self, k: int, points: Array, sigma: Array) -> tuple[Array, Array]:
        """Return points a sample later, by the midpoint rule, and what a torque does to the state of the first."""
        n, T = self.basis.n, 1 / self.fs
        q = points[:n]
        qd = points[n : 2 * n]
        X = points[2 * n :] * sigma[:, None]
        first, _ = self._acceleration(k, q, qd, X)
        middle, inverse = self._acceleration(k, q + T / 2 * qd, qd + T / 2 * first, X)
        moved = np.concatenate([q + T * qd + T**2 / 2 * middle, qd + T * middle, points[2 * n :]])
        return moved, np.concatenate([T**2 / 2 * inverse, T * inverse])

    def _acceleration(self, k: int, q: Array, qd: Array, X: Array) -> tuple[Array, Array]:
        """Return accelerations of points, shape (joint, point), and M^-1 at the first."""
        n = self.basis.n
        bias = np.zeros_like(q)
        for (row, place), column in self.basis.explicit(State(q, qd, lambda _: np.zeros_like(q))).items():
            bias[row] += column * (1.0 if place == HELD else X[place])
        unit = np.eye(n)[:, :, None]
        turned = np.broadcast_to(q, (n, *q.shape))
        M = np.zeros((n, n, q.shape[-1]))
        for (row, place), column in self.basis.momentum(State(turned, unit + np.zeros_like(turned), lambda x: x)).items():
            M[:, row] += column * (1.0 if place == HELD else X[place])
        M = np.moveaxis(M, -1, 0)
        found = np.linalg.solve(M, (self.tau[:, k, None] - bias).T[..., None])[..., 0].T
        return np.asarray(found, dtype=np.float64), np.linalg.inv(M[0])
