"""What rows whose noise differs are divided by in weighted least squares."""

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import scipy

from idbench.identify.arrays import Array, combined
from idbench.identify.models.model import AbstractModel
from idbench.identify.noise.linearization import Linearization, smoothed
from idbench.identify.noise.two_levels import two_levels
from idbench.identify.rows.row_map import RowMap

MIN_RATIO, MAX_RATIO = 0.01, 10.0
"""Range of b/a: residuals of some hundred rows do not show less, and more is as good as equal weights."""


def friction_bias(to_rows: RowMap, linear: Linearization, model: AbstractModel, position: Array) -> Array:
    """Return what noise of the velocities makes of W X where joints hardly move, shape (..., r).

    Friction turns noise into power, Fs |qd|, of one sign: that of a velocity of E|qd + noise| - |qd|.

    Parameters
    ----------
    to_rows : RowMap
        Of one log.
    linear : Linearization
        Of the explicit model, about its signals: basis and X.
    model : AbstractModel
        Whose rows they are.
    position : Array, shape (..., joint)
        Standard deviation of the positions' noise [rad].
    """
    signals = to_rows.signals
    speed = rectified(smoothed(signals.state.qd, signals.fs), position[..., None] * signals.gain)
    columns = model.c(linear.basis, replace(signals.state, qd=speed))
    return to_rows.measurement(combined(columns, linear.X, np.zeros(to_rows.inside.shape)))


def floor_of(squares: Array, variance: Array, valid: npt.NDArray[np.bool_]) -> Array:
    """Return m b/a of the variances a v + b m that explain squared residuals best, m the mean of v, shape (...).

    v is what the noise of torques and positions makes of a row. What is not noise, such as cogging, or friction of another kind
    near standstill, does not vanish where v does: with weights of v alone the slow rows of the power model, in which it is most
    of the torque, would count most. a and b, not negative, are fitted with errors in proportion to the variances themselves.

    Parameters
    ----------
    squares : Array, shape (..., r)
        Squared residuals.
    variance : Array, shape (..., r)
        v.
    valid : bool array, shape (..., r)
        False for void rows, which say nothing.
    """
    count = np.maximum(np.sum(valid, axis=-1, keepdims=True), 1)
    mean = np.sum(variance * valid, axis=-1, keepdims=True) / count
    u = np.divide(variance, mean, out=np.ones_like(variance), where=mean > 0)
    a, b = two_levels(u * valid, np.where(valid, 1.0, 0.0), squares * valid)
    share = np.divide(b, a, out=np.full(a.shape, MAX_RATIO), where=a > 0)
    return mean[..., 0] * np.clip(np.where(np.isfinite(share), share, 1.0), MIN_RATIO, MAX_RATIO)


def reciprocal_root(variance: Array, floor: Array) -> Array:
    """Return 1 / sqrt(v + floor), shape (..., r), for a floor of shape (...); 1 where that is not known."""
    evened = variance + floor[..., None]
    known = np.isfinite(evened) & (evened > 0)
    return 1 / np.sqrt(np.where(known, evened, 1.0))


def rectified(x: Array, sigma: Array) -> Array:
    """Return E|x + n| - |x| for normal n of standard deviation sigma, 2 sigma (phi(u) - u Q(u)) with u = |x| / sigma."""
    known = np.isfinite(sigma) & (sigma > 0)
    scale = np.where(known, sigma, 1.0)
    u = np.abs(x) / scale
    density = np.exp(-(u**2) / 2) / np.sqrt(2 * np.pi)
    return np.where(known, 2 * scale * (density - u * scipy.special.ndtr(-u)), 0.0)
