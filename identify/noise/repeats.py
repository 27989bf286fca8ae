"""How often the errors of an encoder are the same again."""

from collections.abc import Sequence

import numpy as np
import scipy

from idbench.identify.arrays import Array
from idbench.identify.data.motion_log import MotionLog

OVERLAP = 0.1
"""Share of a log that must lie over itself for what it says of a lag to count."""

MAX_SAMPLES = 2**18
"""Samples that a log is looked at."""

PRECISE = 1e-12
"""Share of the mean square of the positions below which differences of them are rounding of our own."""


def repeats(logs: Sequence[MotionLog], sigma: Array) -> Array:
    """Return how many times the variance of an average over the logs is what independent errors of the positions make it.

    A motion that is periodic in whole samples meets the same counts of an encoder again: of m periods the errors are those of
    one, and average out no more than these. With D(lag) the mean square of q(t + lag) - q(t), 2 sigma^2 where errors are
    independent, but the motion repeats itself, and 0 where errors do, too, their correlation is 1 - D / (2 sigma^2). Every lag
    at which that is a maximum above zero, beyond those of a motion that has not left its place yet, adds twice the correlation,
    times the share of the log that lies over itself. A long log goes on as it begins.

    Parameters
    ----------
    logs : sequence of MotionLog
        Of one fit. Each counts by itself.
    sigma : Array, shape (..., joint)
        Standard deviation of the positions' errors [rad].

    Returns
    -------
    Array, shape (..., joint)
        1 where nothing repeats itself.
    """
    samples = sum(log.samples for log in logs)
    return np.asarray(sum(log.samples / samples * _repeats_of(log, sigma) for log in logs))


def _repeats_of(log: MotionLog, sigma: Array) -> Array:
    if log.samples > MAX_SAMPLES:
        return 1 + (_repeats_of(log.part(0, MAX_SAMPLES), sigma) - 1) * (log.samples / MAX_SAMPLES)
    q = np.swapaxes(log.q - np.mean(log.q, axis=-2, keepdims=True), -1, -2)
    N, square = q.shape[-1], np.mean(q**2, axis=-1)
    lags = np.arange(1, round((1 - OVERLAP) * N))
    if len(lags) < 3:
        return np.ones(sigma.shape)
    length = scipy.fft.next_fast_len(2 * N, real=True)
    products = scipy.fft.irfft(np.abs(scipy.fft.rfft(q, length)) ** 2, length)[..., lags]
    squares = np.cumsum(q**2, axis=-1)
    both = squares[..., N - 1 - lags] + squares[..., -1:] - squares[..., lags - 1]
    D = (both - 2 * products) / (N - lags)
    usable = sigma**2 > PRECISE * square
    correlation = 1 - D / np.where(usable, 2 * sigma**2, np.inf)[..., None]
    left = np.maximum.accumulate(correlation < 0, axis=-1)  # beyond lags at which the motion has not left its place
    middle = correlation[..., 1:-1]
    peak = (middle > 0) & (middle >= correlation[..., :-2]) & (middle > correlation[..., 2:]) & left[..., 1:-1]
    added = 2 * np.sum(np.where(peak, middle, 0.0) * (1 - lags[1:-1] / N), axis=-1)
    return 1 + np.where(usable, added, 0.0)
