"""The noise of a log: of positions from their differences, of torques from what the explicit model leaves over."""

from collections.abc import Sequence
from math import comb

import numpy as np

from identify.arrays import Array
from identify.rows.factors import Factors, Fit, Status
from identify.rows.linearization import Linearization
from identify.rows.noise_propagation import NoiseLevels, position_variance, torque_variance
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

    Of the squared residuals of joint j, S_j, the positions' noise makes the share P_j; the rest is the torque's: white noise of
    variance sigma_j^2 gives row i the variance sigma_j^2 v_i, of which the fit takes the share l_i, its leverage, so that
    sigma_j^2 = (S_j - P_j) / sum of v_i (1 - l_i). Whatever it is that the model does not explain counts as noise. Where the
    positions' noise would make more than S_j, it is lowered to it.

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
    position, maps = position_noise([one.signals for one in linear]), [part.maps[0] for part in parts]
    torque = np.concatenate([torque_variance(one, np.ones_like(position)) for one in maps], axis=-1)
    made = np.zeros(factors.rows.shape)
    for one, there in zip(maps, linear, strict=True):
        made += np.sum(position_variance(one, position, there), axis=-1)
    free = np.sum(torque, axis=-1) - _leverage(factors, fit) * torque.max(axis=-1)
    squares = factors.squares(fit.X)
    share = np.minimum(1.0, np.divide(squares, made, out=np.ones_like(squares), where=made > 0))
    rest = np.maximum(squares - made, 0.0)
    variance = np.divide(rest, free, out=np.full(free.shape, np.nan), where=free > 0)
    seen = np.nan_to_num(made / np.where(squares > 0, squares, np.nan)) > NEGLIGIBLE
    return NoiseLevels(np.sqrt(variance), np.where(seen.any(axis=-1, keepdims=True), position * np.sqrt(share), 0.0))


def _leverage(factors: Factors, fit: Fit) -> Array:
    """Return the sum over the rows of every kind of their leverage: the parameters that they determine, shape (..., kind)."""
    R = factors.R[..., :-1] * fit.weight[..., None, None]
    inverse = fit.factor.inverse(factors.together.status == Status.OK)
    return np.sum(np.matmul(R, inverse[..., None, :, :]) * R, axis=(-2, -1))


def position_noise(logs: Sequence[Signals]) -> Array:
    """Return the standard deviation of white noise in the positions of logs [rad], shape (..., joint), while joints move.

    From differences of order 6, whose variance is that of the noise times the sum of their squared weights (P. Hall, J. W. Kay
    and D. M. Titterington, "Asymptotically optimal difference-based estimation of variance in nonparametric regression",
    Biometrika 77 (1990) 521-528). Counts of an encoder at rest are constant, and say nothing. 0 where too little moves.
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
