"""Recursive (IIR) filters run forward and backward, which leaves no phase shift."""

from functools import lru_cache

import numpy as np
import scipy

from idbench.identify.arrays import Array, frozen
from idbench.identify.errors import LogError

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
    # As scipy.signal.sosfiltfilt, which finds the steady state anew in every call: most of the time that short signals take.
    ahead, behind = 2 * x[..., :1] - x[..., pad:0:-1], 2 * x[..., -1:] - x[..., -2 : -pad - 2 : -1]
    y = _filtered(sections, np.concatenate([ahead, x, behind], axis=-1))
    return _filtered(sections, y[..., ::-1])[..., ::-1][..., pad:-pad]


def _filtered(sections: Array, x: Array) -> Array:
    """Return `x`, filtered forward from the steady state of its first value."""
    steady = _steady_state(sections.tobytes()).reshape(-1, *[1] * (x.ndim - 1), 2)
    y, _ = scipy.signal.sosfilt(sections.copy(), x, axis=-1, zi=steady * x[..., :1])  # SciPy wants sections it could write to
    return y


@lru_cache(maxsize=32)
def _steady_state(sections: bytes) -> Array:
    """Return the state of second-order sections that a constant 1 leaves, shape (section, 2)."""
    return frozen(scipy.signal.sosfilt_zi(np.frombuffer(sections).reshape(-1, 6)))
