"""Two levels of noise that explain squares."""

import numpy as np

from idbench.identify.arrays import Array

ROUNDS = 6

FAINT = 1e-3
"""Expectations below this share of the mean count as this: what is found there says more about the expectation."""


def two_levels(x: Array, z: Array, squares: Array) -> tuple[Array, Array]:
    """Return a and b, not negative, with which squares of expectation a x + b z are most likely, shape (...).

    By least squares with errors in proportion to the expectation, round by round (Whittle's likelihood, of a spectrum).

    Parameters
    ----------
    x, z, squares : Array, shape (..., r)
        The two parts of the expectation, not negative, and what was found.
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
