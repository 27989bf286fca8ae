"""The noise of a log: of positions from their differences, of torques from what the explicit model leaves over."""

from collections.abc import Sequence
from math import comb

import numpy as np

from identify.arrays import Array
from identify.estimators.two_levels import two_levels
from identify.rows.factors import Factors, Fit, Status
from identify.rows.linearization import Linearization
from identify.rows.noise_propagation import NoiseLevels, correlations, position_parts, torque_variance, torque_window
from identify.rows.rows import Rows
from identify.signals.signals import Signals
from identify.signals.stencils import slide

ORDER = 6
"""Differences of the positions after which next to nothing of a motion is left, and of white noise much."""

NEGLIGIBLE = 1e-4
"""Share of the squared residuals below which noise of the positions counts as none: it makes 0.005 % of sigma."""

LEAST = 32
"""Samples that it takes to estimate the noise of positions."""


def noise_levels(parts: Sequence[Rows], factors: Factors, fit: Fit, linear: Sequence[Linearization]) -> NoiseLevels:
    """Return the noise of logs as the rows of their explicit model show it.

    How much of the squared residuals of a joint is noise of the torque, and how much that of positions, their spectrum says: it
    is explained, as well as may be, by a T(f) + b P(f), with T what white noise of the torques leaves in these rows, and P what
    that of the positions does. (P lies at high frequencies, where a motion tells little: a small error of P would be a large
    one of the rest.) White noise of variance sigma^2 gives row i the variance sigma^2 v_i, of which the fit takes the share
    l_i, its leverage, so that sigma^2 = squares / sum of v_i (1 - l_i). What the model does not explain counts as noise, too.

    If the squares less those that the positions' noise should make are more than that, they are taken: rather too much than too
    little, up to twice the torque's noise in bands beyond 10 Hz.

    Parameters
    ----------
    parts : sequence of Rows
        Rows of the explicit model, log by log.
    factors : Factors
        Of all these rows.
    fit : Fit
        Their weighted least-squares solution.
    linear : sequence of Linearization
        Of the explicit model, log by log.

    Returns
    -------
    NoiseLevels
        NaN in runs that cannot be solved.
    """
    position = position_noise([one.signals for one in linear])
    found = [_part(rows, rows.Y - rows.predicted(fit.X), position, there) for rows, there in zip(parts, linear, strict=True)]
    white, made, *spectra = (np.concatenate(each, axis=-1) for each in zip(*found, strict=True))
    a, b = two_levels(*spectra)
    of_torque, of_position = a * np.sum(white, axis=-1), b * np.sum(made, axis=-1)
    squares, made = factors.squares(fit.X), np.sum(made, axis=-1)
    share = np.divide(of_torque, of_torque + of_position, out=np.ones_like(of_torque), where=of_torque + of_position > 0)
    rest = np.maximum(share * squares, squares - made)
    free = np.sum(white, axis=-1) - _leverage(factors, fit) * white.max(axis=-1)
    variance = np.divide(rest, free, out=np.full(free.shape, np.nan), where=free > 0)
    most = np.minimum(1.0, np.divide(squares, made, out=np.ones_like(squares), where=made > 0))
    shown = np.nan_to_num(made / np.where(squares > 0, squares, np.nan)) > NEGLIGIBLE
    return NoiseLevels(np.sqrt(variance), np.where(shown.any(axis=-1, keepdims=True), position * np.sqrt(most), 0.0))


def _part(rows: Rows, residual: Array, position: Array, linear: Linearization) -> tuple[Array, ...]:
    """Return variances of rows by unit noise of torques and by that of positions, their spectra, and the residual's."""
    to_rows, step = rows.maps[0], rows.maps[0].grid.step
    white = torque_variance(to_rows, np.ones_like(position))
    made = position_parts(to_rows, position, linear)
    of_torque = _spectrum(white, correlations(torque_window(to_rows), step))
    of_position = sum(_spectrum(np.maximum(variance, 0.0), correlations(window, step)) for variance, window in made)
    rho = rows.by_kind(residual)
    seen = np.abs(np.fft.rfft(rho, 2 * rho.shape[-1])) ** 2
    return white, np.maximum(sum(variance for variance, _ in made), 0.0), of_torque, np.asarray(of_position), seen


def _spectrum(variance: Array, correlation: Array) -> Array:
    """Return the expected |DFT|^2, at twice as many frequencies, of rows with these variances and correlations over rows."""
    n = variance.shape[-1]
    pairs = np.fft.irfft(np.abs(np.fft.rfft(np.sqrt(variance), 2 * n)) ** 2, 2 * n)[..., :n]
    lags = pairs * np.pad(correlation[:n], (0, max(0, n - len(correlation))))
    return np.maximum(2 * np.fft.rfft(lags, 2 * n).real - lags[..., :1], 0.0)


def _leverage(factors: Factors, fit: Fit) -> Array:
    """Return the sum over the rows of every kind of their leverage: the parameters that they determine, shape (..., kind)."""
    R = factors.R[..., :-1] * fit.weight[..., None, None]
    inverse = fit.factor.inverse(factors.together.status == Status.OK)
    return np.sum(np.matmul(R, inverse[..., None, :, :]) * R, axis=(-2, -1))


def position_noise(logs: Sequence[Signals]) -> Array:
    """Return the standard deviation of white noise in the positions of logs [rad], shape (..., joint), where no mask is.

    From differences of order 6, whose variance is that of the noise times the sum of their squared weights (P. Hall, J. W. Kay
    and D. M. Titterington, "Asymptotically optimal difference-based estimation of variance in nonparametric regression",
    Biometrika 77 (1990) 521-528). Counts of an encoder at rest are constant, and say nothing: without a mask they make it too
    small. 0 where little is left.
    """
    weights = np.array([(-1.0) ** k * comb(ORDER, k) for k in range(ORDER + 1)])
    weights /= np.linalg.norm(weights)
    squares, count = 0.0, 0
    for signals in logs:
        inner = slice(ORDER // 2, -(ORDER // 2))  # beyond the ends of a log there is nothing
        moving = (signals.weight == 1)[..., inner]
        differences = slide(np.swapaxes(signals.log.q, -1, -2), weights)[..., inner]
        squares = squares + np.sum(differences**2 * moving, axis=-1)
        count = count + np.sum(moving, axis=-1)
    return np.where(count >= LEAST, np.sqrt(squares / np.maximum(count, 1)), 0.0)
