"""The covariance of an estimate from the autocovariance of its residuals (HAC)."""

from collections.abc import Sequence

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.estimators.simulating.row_products import Kinds, Solved

MEMORY = 1.0  # Time [s] after which residuals are taken for independent: loops and filters remember less


def scatter(found: Solved, kinds: Kinds, logs: Sequence[tuple[slice, float]]) -> Array:
    """Return the covariance of X = G' Y for residuals that are stationary, but correlated in time and between kinds.

    G' C G with C the covariance of residuals as their autocorrelation says, tapered to zero over `MEMORY` (W. K. Newey and
    K. D. West, "A simple, positive semi-definite, heteroskedasticity and autocorrelation consistent covariance matrix",
    Econometrica 55 (1987) 703-708): for estimators whose residuals the noise of the log reaches through a closed loop.

    Parameters
    ----------
    found : Solved
        G and residuals.
    kinds : Kinds
        Which residuals have the same variance.
    logs : sequence of (slice, float)
        Which residuals are those of each log, and how many instants [1/s] they have.
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
