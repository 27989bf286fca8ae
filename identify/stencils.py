"""Short symmetric windows that slide over a signal: derivatives, shifts by a part of a sample, cell averages.

All act along the last axis and repeat the first and last value beyond the ends; a chain drops the samples that see that.
"""

from functools import lru_cache

import numpy as np
from scipy import ndimage

from identify.arrays import Array

REACH = 3
"""Samples to either side from which a value between two samples is interpolated: a polynomial of degree 6."""

CELL = np.array([1.0, 22.0, 1.0]) / 24
"""Weights that turn samples of a smooth signal into its mean over one sampling period around them, to fourth order."""


def slide(x: Array, weights: Array) -> Array:
    """Return sum_i weights[i] x[k + i - m] for every k, with `weights` of odd length 2 m + 1."""
    return ndimage.correlate1d(x, weights, axis=-1, mode="nearest")


def shift(x: Array, samples: float) -> Array:
    """Return x at k + `samples`, for every k; exact for polynomials of degree 2 REACH."""
    whole = round(samples)
    return slide(x, _shift_weights(whole, samples - whole)) if samples else x


@lru_cache(maxsize=64)
def _shift_weights(whole: int, part: float) -> Array:
    """Return the weights of the Lagrange polynomial at `part`, moved by `whole` samples."""
    nodes = np.arange(-REACH, REACH + 1)
    weights = np.zeros(2 * (REACH + abs(whole)) + 1)
    middle = REACH + abs(whole) + whole
    for i in nodes:
        others = nodes[nodes != i]
        weights[middle + i] = np.prod((part - others) / (i - others))
    return weights
