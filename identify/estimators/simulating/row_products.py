"""Least squares of rows with instruments, every run by itself, and its covariance by the residuals' autocovariance."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from idbench.identify.arrays import Array
from idbench.identify.estimators.problem import Problem

WORST = 1e-12  # Reciprocal condition number of Z' W, its rows and columns scaled to length 1, below which it counts as singular
ROUNDS = 2  # How often weights are taken from the residuals of the solution before


@dataclass(frozen=True, eq=False)
class Kinds:
    """Which residuals have the same variance."""

    count: int
    """Kinds; residuals follow each other kind by kind."""
    own: Array
    """What residuals of a kind are multiplied by where they differ; 0 for those that are void, shape (..., r)."""

    @classmethod
    def of_rows(cls, problem: Problem) -> Self:
        """Return the kinds of a problem's rows."""
        rows = problem.rows
        return cls(rows.kinds, rows.valid * problem.weights)

    def by_kind(self, x: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Return values of all residuals, shape (..., r), as (..., instant, kind)."""
        return x.reshape(*x.shape[:-1], -1, self.count)

    def weights(self, residual: Array) -> Array:
        """Return one over the rms of the residuals of every kind, times what they are multiplied by, shape (..., r)."""
        number = np.maximum(np.sum(self.by_kind(self.own) > 0, axis=-2), 1)
        rms = np.sqrt(np.sum(self.by_kind(residual * self.own) ** 2, axis=-2) / number)
        largest = np.max(rms, axis=-1, keepdims=True)
        rms = np.where((largest > 0) & np.isfinite(rms), np.maximum(rms, 1e-12 * largest), 1.0)
        return self.own / np.tile(rms, residual.shape[-1] // self.count)


@dataclass(frozen=True, eq=False)
class Solved:
    """X = G' Y of rows Y = W X + rho."""

    X: Array
    """NaN where Z' W is singular, shape (..., p)."""
    G: Array
    """What X changes by if a row of Y does, shape (..., r, p)."""
    residual: Array
    """Y - W X, shape (..., r)."""
    covariance: Array
    """Of X, as if weighted residuals were independent and alike, shape (..., p, p)."""

    @property
    def sigma(self) -> Array:
        """Standard deviations of X, shape (..., p)."""
        return np.sqrt(np.diagonal(self.covariance, axis1=-2, axis2=-1))

    def where(self, active: npt.NDArray[np.bool_], before: "Solved") -> "Solved":
        """Return this solution in the runs that are active, and that before in the others."""
        pairs = [(getattr(self, x), getattr(before, x)) for x in ("X", "G", "residual", "covariance")]
        return Solved(*(np.where(active.reshape(*active.shape, *[1] * (a.ndim - active.ndim)), a, b) for a, b in pairs))


def solve_with(kinds: Kinds, Y: Array, W: Array, Z: Array) -> Solved:
    """Return X = (Z' w^2 W)^-1 Z' w^2 Y, weights w from the residuals of the solution before, twice.

    Y has shape (..., r), regressors W and instruments Z have (..., r, p); those of least squares are the regressors.
    """
    found = with_weights(Y, W, kinds.own, Z)
    for _ in range(ROUNDS):
        found = with_weights(Y, W, kinds.weights(found.residual), Z)
    return found


def with_weights(Y: Array, W: Array, weight: Array, Z: Array | None = None) -> Solved:
    """Return X = (Z' w^2 W)^-1 Z' w^2 Y for weights w, shape (..., r); by default Z is W: least squares."""
    weighted = (W if Z is None else Z) * (weight**2)[..., None]
    inverse = _inverse(np.matmul(np.swapaxes(weighted, -1, -2), W))
    G = np.matmul(weighted, np.swapaxes(inverse, -1, -2))
    X = np.sum(G * Y[..., None], axis=-2)
    residual = Y - np.matmul(W, X[..., None])[..., 0]
    return Solved(X, G, residual, covariance_by(weight, G, residual))


def covariance_by(weight: Array, G: Array, residual: Array) -> Array:
    """Covariance of X = G' Y if residuals times weights, shape (..., r), are independent and alike, shape (..., p, p)."""
    freedom = np.maximum(np.sum(weight > 0, axis=-1) - G.shape[-1], 1)
    variance = np.sum((residual * weight) ** 2, axis=-1) / freedom
    white = G / np.where(weight > 0, weight, np.inf)[..., None]
    found: Array = variance[..., None, None] * np.matmul(np.swapaxes(white, -1, -2), white)
    return found


def _inverse(product: Array) -> Array:
    """Return the inverses of matrices, shape (..., p, p), NaN of singular ones."""
    rows = _lengths(product, -1)
    columns = _lengths(product / rows, -2)
    scaled = product / rows / columns
    known = np.asarray(np.isfinite(scaled).all(axis=(-2, -1)))
    values: Array = np.linalg.svd(np.where(known[..., None, None], scaled, 0.0), compute_uv=False)
    good = np.asarray(known & (values[..., -1] > WORST * values[..., 0]))[..., None, None]
    inverse = np.linalg.inv(np.where(good, scaled, np.eye(product.shape[-1])))
    return np.where(good, inverse / np.swapaxes(columns, -1, -2) / np.swapaxes(rows, -1, -2), np.nan)


def _lengths(product: Array, axis: int) -> Array:
    length = np.linalg.norm(product, axis=axis, keepdims=True)
    return np.where(length > 0, length, 1.0)


MEMORY = 1.0  # Time [s] after which residuals are taken for independent: loops and filters remember less


def scatter(found: Solved, kinds: Kinds, logs: Sequence[tuple[slice, float]]) -> Array:
    """Return the covariance of X = G' Y for residuals that are stationary, but correlated in time and between kinds.

    G' C G with C the covariance of residuals as their autocorrelation says, tapered to zero over `MEMORY` (W. K. Newey and
    K. D. West, "A simple, positive semi-definite, heteroskedasticity and autocorrelation consistent covariance matrix",
    Econometrica 55 (1987) 703-708): for estimators whose residuals the noise of the log reaches through a closed loop. `logs`
    has the residuals of each log, and their instants per second [1/s].
    """
    own = kinds.own > 0
    total = np.zeros(found.covariance.shape)
    freedom = np.sum(own, axis=-1)
    share = freedom / np.maximum(freedom - found.X.shape[-1], 1)
    for part, rate in logs:
        weight = kinds.own[..., part]
        e = np.swapaxes(kinds.by_kind(found.residual[..., part] * weight), -1, -2)
        G = found.G[..., part, :] / np.where(weight > 0, weight, np.inf)[..., None]
        G = G.reshape(*G.shape[:-2], -1, kinds.count, G.shape[-1])
        total = total + _through(e, np.moveaxis(G, -3, -1), np.swapaxes(kinds.by_kind(own[..., part]), -1, -2), rate)
    return total * share[..., None, None]


def _through(e: Array, G: Array, own: Array, rate: float) -> Array:
    """Return G' C G; e and own of shape (..., kind, instant), G of shape (..., kind, p, instant)."""
    count, lags = e.shape[-1], max(1, round(MEMORY * rate))
    size = 2 * max(count, lags)
    seen = np.maximum(np.sqrt(np.mean(own, axis=-1)), 1e-12)
    spectra = np.fft.rfft(e / seen[..., None], size)
    cross = np.fft.irfft(np.conj(spectra[..., :, None, :]) * spectra[..., None, :, :], size) / count
    lag = np.minimum(np.arange(size), size - np.arange(size))
    C = np.fft.rfft(cross * np.maximum(1 - lag / lags, 0.0), size)
    of_G = np.fft.rfft(G, size)
    twice = np.where((np.arange(size // 2 + 1) == 0) | (np.arange(size // 2 + 1) == size // 2), 1.0, 2.0)
    left = np.einsum("...abf,...bpf->...apf", np.conj(C) * twice, of_G)
    found: Array = np.einsum("...apf,...aqf->...pq", np.conj(of_G), left).real / size
    return (found + np.swapaxes(found, -1, -2)) / 2
