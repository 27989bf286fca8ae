"""How the variance of rows depends on what noise makes of them, as residuals show it."""

import numpy as np
import scipy

from identify.arrays import Array

LEAST, MOST = 0.01, 10.0
"""Range of b/a: residuals of some hundred rows do not show less, and more is as good as equal weights."""

ROUNDS = 10


def floor_of(squares: Array, variance: Array) -> Array:
    """Return m b/a of the variances a v + b m that explain squared residuals best, m the mean of v, shape (...).

    v is what the noise of torques and positions makes of a row. What no noise is, such as cogging, or friction of another kind
    near standstill, does not vanish where v does: with weights of v alone the slow rows of the power model, in which it is most
    of the torque, would count most. a and b, not negative, are fitted with errors in proportion to the variances themselves.

    Parameters
    ----------
    squares : Array, shape (..., r)
        Squared residuals.
    variance : Array, shape (..., r)
        v.
    """
    mean = np.mean(variance, axis=-1, keepdims=True)
    u = np.divide(variance, mean, out=np.ones_like(variance), where=mean > 0)
    a = b = np.mean(squares, axis=-1, keepdims=True) / 2
    for _ in range(ROUNDS):
        size = np.maximum(a * u + b, 1e-12 * (a + b) + 1e-300)
        ones, ramp, y = 1 / size, u / size, squares / size
        a, b = _not_negative(ramp, ones, y)
    share = np.divide(b, a, out=np.full(a.shape, MOST), where=a > 0)[..., 0]
    return mean[..., 0] * np.clip(np.where(np.isfinite(share), share, 1.0), LEAST, MOST)


def _not_negative(x: Array, z: Array, y: Array) -> tuple[Array, Array]:
    """Return a and b, not negative, of the least squares a x + b z = y along the last axis, which they keep with length 1."""
    xx, xz, zz, xy, zy = (np.sum(p * q, axis=-1, keepdims=True) for p, q in ((x, x), (x, z), (z, z), (x, y), (z, y)))
    determinant = xx * zz - xz**2
    regular = determinant > 1e-12 * xx * zz
    a = np.divide(xy * zz - zy * xz, determinant, out=np.zeros_like(xx), where=regular)
    b = np.divide(zy * xx - xy * xz, determinant, out=zy / zz, where=regular)
    return np.where(b < 0, xy / xx, np.maximum(a, 0.0)), np.where(a < 0, zy / zz, np.maximum(b, 0.0))


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
