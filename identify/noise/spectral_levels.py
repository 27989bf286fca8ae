"""The noise of a log: of positions from their differences, of torques from the residuals of the explicit model."""

from collections.abc import Sequence
from math import comb

import numpy as np
import scipy

from idbench.identify.arrays import Array
from idbench.identify.data.jumps import ORDER
from idbench.identify.data.motion_log import MotionLog
from idbench.identify.noise.covariance import BandedCovariance
from idbench.identify.noise.noisy_rows import NoisyRows
from idbench.identify.noise.propagation import NoiseLevels
from idbench.identify.noise.row_weights import two_levels
from idbench.identify.rows.factors import Factors, LeastSquaresFit, Status
from idbench.identify.rows.rows import Rows
from idbench.identify.signals.filters import slide
from idbench.identify.signals.signals import Signals

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


NEGLIGIBLE = 1e-4
"""Share of the squared residuals below which noise of the positions counts as none: it makes 0.005 % of sigma."""

MIN_SAMPLES = 32
"""Samples that it takes to estimate the noise of positions."""

FREE = 0.01
"""Share of the rows of a kind that the fit leaves free at least."""

TOLD = 2.0
"""Rows whose residuals count as noise of the torque, whatever their spectrum says: that of a few rows says little."""


def spectral_levels(
    parts: Sequence[Rows], noisy: Sequence[NoisyRows], factors: Factors, fit: LeastSquaresFit, position: Array
) -> NoiseLevels:
    """Return the noise of logs as the rows of their explicit model show it, NaN in runs that cannot be solved.

    How much of the squared residuals of a joint is noise of the torque, and how much that of positions, their spectrum says: it
    is explained, as well as may be, by a T(f) + b P(f), with T what white noise of the torques leaves in these rows, and P what
    that of the positions does. (P lies at high frequencies, where a motion has little information: a small error of P would be
    a large one of the rest.) White noise of variance sigma^2 gives row i the variance sigma^2 v_i, of which the fit takes the
    share l_i, its leverage, so that sigma^2 = squares / sum of v_i (1 - l_i). What the model does not explain counts as noise.

    Parameters
    ----------
    parts : sequence of Rows
        Rows of the explicit model, log by log.
    noisy : sequence of NoisyRows
        How noise reaches them.
    factors : Factors
        Of all these rows.
    fit : Fit
        Their weighted least-squares solution.
    position : Array, shape (..., joint)
        Standard deviation of the positions' noise, as their differences show it [rad].
    """
    level = position[..., None, :]  # of every kind by itself
    white = [each.torque.by_kind().covariance(np.ones_like(level)) for each in noisy]
    made = [each.position.by_kind().covariance(level) for each in noisy]
    squares, of_position = factors.squares(fit.X), np.sum(_variances(made), axis=-1)
    shown = np.nan_to_num(of_position / np.where(squares > 0, squares, np.nan)) > NEGLIGIBLE
    rest = np.where(shown, _torque_share(parts, fit.X, white, made), 1.0) * squares
    of_torque = _variances(white)
    whole = np.sum(of_torque, axis=-1)
    free = np.maximum(np.sum(of_torque * (1 - _leverage(parts, factors, fit)), axis=-1), FREE * whole)
    torque = np.sqrt(np.divide(rest, free, out=np.full(free.shape, np.nan), where=free > 0))
    most = np.minimum(1.0, np.divide(squares, of_position, out=np.ones_like(squares), where=of_position > squares))
    return NoiseLevels(torque, np.where(shown.any(axis=-1, keepdims=True), position * np.sqrt(most), 0.0))


def _variances(covariances: Sequence[BandedCovariance]) -> Array:
    """Return the variances of the rows of all logs, shape (..., kind, instant), from the covariances kind by kind."""
    return np.concatenate([C.variance for C in covariances], axis=-1)


def _torque_share(
    parts: Sequence[Rows], X: Array, white: Sequence[BandedCovariance], made: Sequence[BandedCovariance]
) -> Array:
    """Return the share of the squared residuals that noise of the torque makes, as their spectrum says, shape (..., kind)."""
    residuals = [rows.by_kind(rows.Y - rows.predicted(X)) for rows in parts]
    seen = np.concatenate([np.abs(np.fft.rfft(rho, 2 * rho.shape[-1])) ** 2 for rho in residuals], axis=-1)
    T, P = (np.concatenate([C.spectrum[..., 0, :] for C in each], axis=-1) for each in (white, made))
    a, b = two_levels(T, P, seen)
    of_torque, of_position = a * np.sum(_variances(white), axis=-1), b * np.sum(_variances(made), axis=-1)
    both = of_torque + of_position
    share = np.divide(of_torque, both, out=np.ones_like(both), where=both > 0)
    few = np.maximum(np.count_nonzero(_variances(white), axis=-1), 1)
    return np.maximum(share, np.minimum(TOLD / few, 1.0))


def _leverage(parts: Sequence[Rows], factors: Factors, fit: LeastSquaresFit) -> Array:
    """Return the share of every row that the fit takes, shape (..., kind, instant)."""
    inverse = fit.factor.inverse(factors.together.status == Status.OK)
    each = [rows.by_kind(np.sum(np.matmul(rows.W, inverse) * rows.W, axis=-1)) for rows in parts]
    return np.concatenate(each, axis=-1) * fit.weight[..., None] ** 2


def position_noise(logs: Sequence[Signals]) -> Array:
    """Return the standard deviation of white noise in the positions of logs [rad], shape (..., joint), where no mask is.

    From differences of order 6, whose variance is that of the noise times the sum of their squared weights (P. Hall, J. W. Kay
    and D. M. Titterington, "Asymptotically optimal difference-based estimation of variance in nonparametric regression",
    Biometrika 77 (1990) 521-528). Counts of an encoder at rest are constant, and say nothing: without a mask they make it too
    small. Where it leaves too few samples, all that change count; 0 where there are few of those, too.
    """
    weights = np.array([(-1.0) ** k * comb(ORDER, k) for k in range(ORDER + 1)])
    weights /= np.linalg.norm(weights)
    squares: Array | float = 0.0
    count: Array | float = 0.0
    for signals in logs:
        inner = slice(ORDER // 2, -(ORDER // 2))  # beyond the ends of a log there is nothing
        moving = (signals.weight == 1)[..., inner]
        differences = slide(np.swapaxes(signals.log.q, -1, -2), weights)[..., inner]
        counts = np.stack([moving, differences != 0])
        squares = squares + np.sum(differences**2 * counts, axis=-1)
        count = count + np.sum(counts, axis=-1)
    used, changing = np.where(np.asarray(count) >= MIN_SAMPLES, np.sqrt(squares / np.maximum(count, 1)), 0.0)
    return np.where(np.asarray(count)[0] >= MIN_SAMPLES, used, changing)
