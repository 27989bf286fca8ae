"""What rows whose noise differs are divided by in weighted least squares."""

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import scipy

from idbench.identify.arrays import Array, combined
from idbench.identify.models import AbstractModel
from idbench.identify.noise.linearization import Linearization, smoothed
from idbench.identify.rows.row_map import RowMap
from idbench.identify.rows.rows import Rows
from idbench.identify.signals.signals import Signals

ROUNDS = 6  # Iterations: each takes nine tenths of the error away
FAINT = 1e-3  # Expectations below this share of the mean count as this: what is found there says more about the expectation


def two_levels(x: Array, z: Array, squares: Array) -> tuple[Array, Array]:
    """Return a and b, not negative, with which squares of expectation a x + b z are most likely, shape (...).

    (a, b)(k+1) = argmin sum ((y - a x - b z) / (a(k) x + b(k) z))^2: least squares with errors in proportion to the
    expectation, iterated (Whittle's likelihood, of a spectrum). x and z, not negative, and squares have shape (..., r).
    """
    x, z, squares = np.broadcast_arrays(x, z, squares)
    means = [np.mean(part, axis=-1, keepdims=True) for part in (x, z, squares)]
    x, z, y = (np.divide(p, m, out=np.zeros_like(p), where=m > 0) for p, m in zip((x, z, squares), means, strict=True))
    a = b = np.full(means[2].shape, 0.5)
    for _ in range(ROUNDS):
        size = np.maximum(a * x + b * z, FAINT)
        a, b = _not_negative(x / size, z / size, y / size)
    found = (np.divide(c * means[2], m, out=np.zeros_like(m), where=m > 0) for c, m in ((a, means[0]), (b, means[1])))
    return next(found)[..., 0], next(found)[..., 0]


def _not_negative(x: Array, z: Array, y: Array) -> tuple[Array, Array]:
    """Return a and b, not negative, of the least squares a x + b z = y along the last axis, which they keep with length 1."""
    xx, xz, zz, xy, zy = (np.sum(p * q, axis=-1, keepdims=True) for p, q in ((x, x), (x, z), (z, z), (x, y), (z, y)))
    determinant = xx * zz - xz**2
    regular = determinant > 1e-12 * xx * zz
    of_x, of_z = (np.divide(s, m, out=np.zeros_like(s), where=m > 0) for s, m in ((xy, xx), (zy, zz)))
    a = np.divide(xy * zz - zy * xz, determinant, out=np.where(zz > 0, 0.0, of_x), where=regular)
    b = np.divide(zy * xx - xy * xz, determinant, out=of_z.copy(), where=regular)
    return np.where(b < 0, of_x, np.maximum(a, 0.0)), np.where(a < 0, of_z, np.maximum(b, 0.0))


SURE = 4.0  # Speed over the noise of the velocity at which a joint is certain to move the way it seems to


def unbiased(rows: Rows, noisier: Rows) -> Rows:
    """Return the rows of one log with W less what noise of the positions adds to it, by those of `with_more_noise`.

    Columns hold squares of velocities and sines of positions, so that noise does not average out of them. More noise n of the
    same size, put in with either sign, shows how much: W(q + n) + W(q - n) - 2 W(q) holds the squares alone, and its half is,
    on average, what the log's own noise has added. (One noise is enough: only its squares are left to chance.)
    """
    return replace(rows, W=2 * rows.W - np.mean(noisier.W, axis=0))


def with_more_noise(signals: Signals, level: Array) -> Signals:
    """Return the signals of two logs, with more noise in the positions, put in with either sign, and with the same mask.

    Every run meets the same noise; which joint gets which part of it depends on how far it moves, not on the order of joints.
    Joints that hardly move get none: their encoder's error is constant, and |qd|, of Coulomb friction, has no square. `level`
    is the standard deviation of the positions' noise [rad], shape (..., joint).
    """
    log, rng = signals.log, np.random.default_rng(0)
    moves = np.abs(smoothed(signals.state.qd, log.fs)) > SURE * signals.gain * level[..., None]
    drawn = np.broadcast_to(rng.standard_normal(log.q.shape[-2:]), log.q.shape)
    far = np.argsort(np.argsort(np.std(log.q, axis=-2, keepdims=True)))
    noise = np.swapaxes(moves * level[..., None], -1, -2) * np.take_along_axis(drawn, far, axis=-1)
    q = np.stack([log.q + noise, log.q - noise])
    return replace(signals, log=replace(log, q=q, tau=np.broadcast_to(log.tau, q.shape)), weights_of=signals)


MIN_RATIO, MAX_RATIO = 0.01, 10.0
"""Range of b/a: residuals of some hundred rows do not show less, and more is as good as equal weights."""


def friction_bias(to_rows: RowMap, linear: Linearization, model: AbstractModel, position: Array) -> Array:
    """Bias of W X by noise of the velocities where joints hardly move, in rows of power alone, shape (..., r).

    Friction turns noise into power, Fs |qd|, of one sign: that of a velocity of E|qd + noise| - |qd|. `position` is the
    standard deviation of the positions' noise [rad], shape (..., joint).
    """
    signals = to_rows.signals
    speed = rectified(smoothed(signals.state.qd, signals.fs), position[..., None] * signals.gain)
    powers = {row for (row, _), B in to_rows.B.items() if not isinstance(B, float)}
    every = model.c(linear.basis, replace(signals.state, qd=speed))
    columns = {(row, place): column for (row, place), column in every.items() if row in powers}
    return to_rows.measurement(combined(columns, linear.X, np.zeros(to_rows.inside.shape)))


def floor_of(squares: Array, variance: Array, valid: npt.NDArray[np.bool_]) -> Array:
    """Return m b/a of the variances a v + b m that explain squared residuals best, m the mean of v, shape (...).

    v is what the noise of torques and positions makes of a row. What is not noise, such as cogging, or friction of another kind
    near standstill, does not vanish where v does: with weights of v alone the slow rows of the power model, in which it is most
    of the torque, would count most. a and b, not negative, are fitted with errors in proportion to the variances themselves, to
    squares and variances of shape (..., r), of rows that are valid.
    """
    mean = np.sum(variance * valid, axis=-1, keepdims=True) / np.maximum(np.sum(valid, axis=-1, keepdims=True), 1)
    u = np.divide(variance, mean, out=np.ones_like(variance), where=mean > 0)
    a, b = two_levels(u * valid, np.where(valid, 1.0, 0.0), squares * valid)
    share = np.divide(b, a, out=np.full(a.shape, MAX_RATIO), where=a > 0)
    return mean[..., 0] * np.clip(np.where(np.isfinite(share), share, 1.0), MIN_RATIO, MAX_RATIO)


def reciprocal_root(variance: Array, floor: Array) -> Array:
    """Return 1 / sqrt(v + floor), shape (..., r), for a floor of shape (...); 1 where that is not known."""
    evened = variance + floor[..., None]
    return 1 / np.sqrt(np.where(np.isfinite(evened) & (evened > 0), evened, 1.0))


def rectified(x: Array, sigma: Array) -> Array:
    """Return E|x + n| - |x| for normal n of standard deviation sigma, 2 sigma (phi(u) - u Q(u)) with u = |x| / sigma."""
    known = np.isfinite(sigma) & (sigma > 0)
    scale = np.where(known, sigma, 1.0)
    u = np.abs(x) / scale
    density = np.exp(-(u**2) / 2) / np.sqrt(2 * np.pi)
    return np.where(known, 2 * scale * (density - u * scipy.special.ndtr(-u)), 0.0)
