"""Recursive (IIR) filters run forward and backward, which leaves no phase shift."""

import numpy as np
import scipy

from identify.arrays import Array
from identify.errors import LogError

SETTLED = 0.01
"""A recursive filter remembers for ever; it counts as settled when its slowest mode has decayed to this share."""


def settling_time(sections: Array, fs: float) -> float:
    """Return the time [s] in which the slowest mode of a filter in second-order sections decays to SETTLED."""
    radius = max(np.abs(np.roots(denominator)).max() for denominator in sections[:, 3:])
    return float(np.log(SETTLED) / np.log(radius) / fs)


def forward_backward(sections: Array, x: Array) -> Array:
    """Return `x`, shape (..., time), filtered forward and backward; raise LogError if there are too few samples."""
    pad = 3 * (2 * len(sections) + 1)
    if x.shape[-1] <= pad:
        raise LogError(f"the log has {x.shape[-1]} samples, the filter needs more than {pad}: use a longer log")
    # SciPy wants sections that it could write to.
    return scipy.signal.sosfiltfilt(sections.copy(), x, axis=-1, padlen=pad)
