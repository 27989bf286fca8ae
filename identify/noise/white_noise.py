"""The white noise of a log, from differences of its positions and torques."""

from collections.abc import Iterable, Sequence
from math import comb
from typing import Literal

import numpy as np
import scipy

from idbench.identify.arrays import Array
from idbench.identify.data.jumps import ORDER, encoder_steps
from idbench.identify.data.motion_log import MotionLog
from idbench.identify.noise.propagation import NoiseLevels, NoisyRows
from idbench.identify.rows.factors import Factors
from idbench.identify.rows.rows import Rows
from idbench.identify.signals.filters import slide
from idbench.identify.signals.signals import Signals

OVERLAP = 0.1  # Share of a log that must lie over itself for what it says of a lag to count
MAX_SAMPLES = 2**18  # Samples that a log is looked at
PRECISE = 1e-12  # Share of the mean square of the positions below which differences of them are rounding of our own


def repeats(logs: Sequence[MotionLog], sigma: Array) -> Array:
    """Variance of an average over the logs, over that of independent position errors.

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
    D = ((squares[..., N - 1 - lags] + squares[..., -1:] - squares[..., lags - 1]) - 2 * products) / (N - lags)
    usable = sigma**2 > PRECISE * square
    correlation = 1 - D / np.where(usable, 2 * sigma**2, np.inf)[..., None]
    left = np.maximum.accumulate(correlation < 0, axis=-1)  # beyond lags at which the motion has not left its place
    middle = correlation[..., 1:-1]
    peak = (middle > 0) & (middle >= correlation[..., :-2]) & (middle > correlation[..., 2:]) & left[..., 1:-1]
    return 1 + np.where(usable, 2 * np.sum(np.where(peak, middle, 0.0) * (1 - lags[1:-1] / N), axis=-1), 0.0)


MIN_SAMPLES = 32  # Samples that it takes to estimate noise
EXACT = 1e-5  # Share of the torque's rms that counts as noise at least: no model of a robot is better


def torque_noise(logs: Sequence[Signals]) -> Array:
    """Return the standard deviation of white noise in the torques [N m], shape (..., joint), from differences, as of positions.

    Residuals may allow less: a torque that is switched, or that a controller makes of a rough position, has large differences
    without any noise. Infinite for poses, of which residuals alone say something.
    """
    rms = np.sqrt(np.mean([np.mean(_logged(each, "tau") ** 2, axis=-1) for each in logs], axis=0))
    poses = any(each.log.poses for each in logs)
    return np.maximum(white_noise(logs, "tau"), EXACT * rms) + (np.inf if poses else 0.0)


def residual_level(
    parts: Sequence[Rows], noisy: Sequence[NoisyRows], factors: Factors, X: Array, others: NoiseLevels | None = None
) -> Array:
    """Return the noise of torques that has the squares of the residuals, less those of `others`, shape (..., joint) [N m].

    0 where the others have more, NaN of joints without rows.
    """
    one = np.ones(parts[0].kinds)

    def summed(variances: Iterable[Array]) -> Array | int:
        each = zip(parts, variances, strict=True)
        return sum(np.sum(np.ascontiguousarray(rows.by_kind(variance)), axis=-1) for rows, variance in each)

    of_one = summed(each.torque.variance(one) for each in noisy)
    left = factors.squares(X) - (summed(each.variance(others) for each in noisy) if others else 0)
    found = np.divide(np.maximum(left, 0.0), of_one, out=np.full(factors.rows.shape, np.nan), where=np.asarray(of_one) > 0)
    return np.sqrt(found)


def white_noise(logs: Sequence[Signals], logged: Literal["q", "tau"]) -> Array:
    """Return the standard deviation of white noise in positions [rad] or torques [N m], shape (..., joint), where no mask is.

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
        differences = slide(_logged(signals, logged), weights)[..., inner]
        counts = np.stack([moving, differences != 0]) & (not signals.log.poses)  # nothing is between two of these
        squares = squares + np.sum(differences**2 * counts, axis=-1)
        count = count + np.sum(counts, axis=-1)
    used, changing = np.where(np.asarray(count) >= MIN_SAMPLES, np.sqrt(squares / np.maximum(count, 1)), 0.0)
    return np.where(np.asarray(count)[0] >= MIN_SAMPLES, used, changing)


def count_noise(logs: Sequence[MotionLog], logged: Literal["q", "tau"] = "q") -> Array:
    """Standard deviation of rounding to the step of positions [rad], or torques [N m], shape (..., joint); 0 without a step."""
    x = np.concatenate([log.q if logged == "q" else log.tau * np.asarray(log.torque.gain) for log in logs], axis=-2)
    found = np.zeros((*x.shape[:-2], x.shape[-1]))
    for run in np.ndindex(x.shape[:-2]):  # each by itself, or its bits would depend on the others
        found[run] = np.nan_to_num(encoder_steps(x[run])) / np.sqrt(12)
    return found


def _logged(signals: Signals, name: Literal["q", "tau"]) -> Array:
    """Return positions [rad], or torques [N m], as they were logged, shape (..., joint, time)."""
    log = signals.log
    return np.swapaxes(log.q if name == "q" else log.tau * np.asarray(log.torque.gain), -1, -2)
