"""Samples that are far off what their neighbours say, and what these say instead."""

import numpy as np
import numpy.typing as npt
import scipy

from idbench.identify.arrays import Array

WILD = 6.0  # Standard deviations, from a quantile of the absolute differences, beyond which a sample is wild
REACH = 2  # Samples to either side from which the one between them is interpolated, by a cubic
PASSES = 50  # Times at most that wild samples are sought: neighbours of one look wild until it is replaced

SHARE, SIGMA = 0.8, 1 / 1.2816
"""Quantile of the absolute differences from which their standard deviation follows, and its ratio to that."""

CUBIC = np.array([-1.0, 4.0, 0.0, 4.0, -1.0]) / 6.0  # Weights with which neighbours say a sample


def without_wild_samples(x: Array, least: float) -> tuple[Array, npt.NDArray[np.bool_]]:
    """Return signals whose wild samples are replaced by what their neighbours say, and which those were.

    A sample is wild if it differs from the cubic through two neighbours to either side by `WILD` standard deviations of such
    differences, as a quantile of their absolute values gives it, and by more than the samples near it. The most wild are
    replaced first, so that one does not accuse its neighbours; what replaces them is a cubic spline through the others:
    x(k+1) = spline of x(k) without its samples of |x - cubic| > WILD s.

    Parameters
    ----------
    x : Array, shape (..., time)
        Positions or torques.
    least : float
        Standard deviation of the differences at least, as a share of that of the signal: bends of what is smooth are not wild.
    """
    wild = np.zeros(x.shape, dtype=bool)
    if x.shape[-1] <= 2 * REACH:
        return x.copy(), wild
    scale = np.maximum(_scale(_off(x)[..., REACH:-REACH]), least * np.std(x, axis=-1, keepdims=True))
    found = x
    for _ in range(PASSES):
        size = _off(found)
        worst = size >= scipy.ndimage.maximum_filter1d(size, 2 * REACH + 1, axis=-1)
        now = worst & (size > WILD * scale) & (scale > 0) & ~wild
        if not now.any():
            break
        wild |= now
        found = _interpolated(x, wild)
    return found, wild


def _scale(off: Array) -> Array:
    """Return the standard deviation of differences, shape (..., 1), from those that are not zero: standing counts are."""
    some = np.where(off > 0, off, np.nan)
    some = np.where(np.isnan(some).all(axis=-1, keepdims=True), 0.0, some)
    return np.asarray(SIGMA * np.nanquantile(some, SHARE, axis=-1, keepdims=True))


def _off(x: Array) -> Array:
    """Distance of samples from the cubic through their neighbours, shape (..., time), 0 at the ends."""
    off = np.abs(x - scipy.ndimage.correlate1d(x, CUBIC, axis=-1))
    off[..., :REACH] = off[..., -REACH:] = 0.0
    return np.asarray(off)


def _interpolated(x: Array, wild: npt.NDArray[np.bool_]) -> Array:
    """Return signals with other samples, those that are wild on the cubic spline through the others."""
    found, t = x.copy(), np.arange(x.shape[-1], dtype=np.float64)
    for place in np.ndindex(x.shape[:-1]):
        if (bad := wild[place]).any():
            found[(*place, bad)] = scipy.interpolate.make_interp_spline(t[~bad], x[(*place, ~bad)], k=3)(t[bad])
    return found
