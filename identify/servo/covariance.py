"""The covariance of the parameters of a servo, from the scatter of the residuals."""

import numpy as np

from identify.arrays import Array
from identify.servo.closed_loop import ServoLoop
from identify.servo.search import Found

MIN_CLUSTERS = 1.5
"""Runs, or pieces of them, per parameter from which on they are the clusters; of fewer, stretches of time are."""

LONGEST = 0.1
"""Longest lag over which residuals may be correlated, as a share of a run."""


def covariance(found: Found, loop: ServoLoop, c: float) -> Array:
    """Return H^-1 S H^-1: H the curvature of the objective, S the covariance of its gradient (P. J. Huber, 1967).

    Both are those that are left when every change of the parameters comes with the best beginnings of the runs.

    S adds up over runs where there are enough of them; otherwise products of scores over lags within their correlation time
    (W. K. Newey and K. D. West, Econometrica 55 (1987) 703-708).
    """
    J, r = found.sensitivity, found.residual
    size = np.sqrt((J**2).mean(axis=(0, 1)))
    size = np.where(size > 0, size, 1.0)
    J = J / size
    w = 1 / (1 + np.abs(r) / c)
    flat = J.reshape(-1, J.shape[-1])
    free = found.beginning.free_of(J, w**2)
    H = free.reshape(flat.shape).T @ (flat * (w**2).reshape(-1, 1))  # of Fair's function: the derivative of r w
    scores = free * (w * r)[..., None]
    p, runs = J.shape[-1], len(r)
    S = _of_runs(scores) * runs / (runs - p) if runs >= MIN_CLUSTERS * p else _of_lags(scores, _lag(r, loop))
    inverse = np.linalg.pinv(H, hermitian=True)
    return np.asarray(inverse @ S @ inverse / np.outer(size, size))


def _of_runs(scores: Array) -> Array:
    total = scores.sum(axis=1)
    return np.asarray(total.T @ total)


def _of_lags(scores: Array, lag: int) -> Array:
    flat = scores.reshape(-1, scores.shape[-1])
    S = flat.T @ flat
    for k in range(1, lag + 1):
        part = (1 - k / (lag + 1)) * np.einsum("rti,rtj->ij", scores[:, k:], scores[:, :-k])
        S = S + part + part.T
    return np.asarray(S)


def _lag(r: Array, loop: ServoLoop) -> int:
    """Return over how many samples residuals are correlated: thrice their correlation time, Bartlett's weights half it."""
    most = int(LONGEST * loop.samples)
    power = np.abs(np.fft.rfft(r, 2 * r.shape[1], axis=1)) ** 2
    correlation = np.fft.irfft(power.mean(axis=0))[: most + 1]
    if correlation[0] <= 0:
        return 0
    correlation = correlation / correlation[0]
    negative = np.flatnonzero(correlation < 0.05)
    end = int(negative[0]) if len(negative) else most
    return min(most, 3 * end)
