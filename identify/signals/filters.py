"""Differentiators, and their table."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import lru_cache
from math import floor
from typing import Literal

import numpy as np
import scipy

from idbench.identify.arrays import Array, frozen
from idbench.identify.errors import LogError, SettingError, require_positive
from idbench.identify.plugins import Table

SETTLED = 0.01  # A recursive filter remembers for ever; it counts as settled when its slowest mode has decayed to this share


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


REACH = 4  # Samples to either side from which a value between two samples is interpolated: a polynomial of degree 7


def slide(x: Array, weights: Array, spacing: int = 1) -> Array:
    """Return sum_i weights[i] x[k + (i - m) spacing] for every k, with `weights` of odd length 2 m + 1."""
    if spacing == 1:
        return scipy.ndimage.correlate1d(x, weights, axis=-1, mode="nearest")
    result = np.empty_like(x)
    for start in range(spacing):
        comb = slice(start, None, spacing)
        result[..., comb] = scipy.ndimage.correlate1d(x[..., comb], weights, axis=-1, mode="nearest")
    return result


def averaged(x: Array, variance: float) -> Array:
    """Return the mean of `x` over a window of this variance [samples^2] around every sample, to fourth order."""
    return slide(x, np.array([variance / 2, 1 - variance, variance / 2])) if variance else x


def between_samples(x: Array, places: Array) -> Array:
    """Return `x`, shape (..., time), at places [samples], shape (m,), from 0 to its last sample: linear between two.

    x(k + s) = x(k) + s (x(k + 1) - x(k)).
    """
    first = places.astype(np.intp)
    s = places - first
    there = x[..., first]
    if not s.any():
        return there
    later: Array = x[..., np.minimum(first + 1, x.shape[-1] - 1)]
    return there + s * (later - there)


def shift(x: Array, samples: float) -> Array:
    """Return x at k + `samples`, for every k; exact for polynomials of degree 2 REACH - 1."""
    whole = floor(samples)
    moved = x[..., np.clip(np.arange(x.shape[-1]) + whole, 0, x.shape[-1] - 1)] if whole else x
    return moved if samples == whole else slide(moved, _between(samples - whole))


@lru_cache(maxsize=64)
def _between(part: float) -> Array:
    """Return the weights of the samples -REACH ... REACH that interpolate at `part`, between the samples 0 and 1."""
    nodes = np.arange(1 - REACH, REACH + 1)
    weights = np.zeros(2 * REACH + 1)
    for i in nodes:
        others = nodes[nodes != i]
        weights[REACH + i] = np.prod((part - others) / (i - others))
    return weights


class AbstractDifferentiator(ABC):
    """The operator s = d/dt on sampled signals, without phase shift."""

    @abstractmethod
    def halo(self, fs: float) -> float:
        """Reach of the derivative to either side [s]."""

    @abstractmethod
    def derivative(self, x: Array, fs: float) -> Array:
        """Return dx/dt of `x`, shape (..., time), sampled at `fs` [Hz]."""


_WEIGHTS = {2: np.array([-1.0, 0.0, 1.0]) / 2, 6: np.array([-1.0, 9.0, -45.0, 0.0, 45.0, -9.0, 1.0]) / 60}
"""Weights that are exact for polynomials of degree 2 and 6."""


@dataclass(frozen=True)
class CentralDifference(AbstractDifferentiator):
    """Central difference of order 2 (the paper's) or 6."""

    order: Literal[2, 6] = 6
    """Order of accuracy. At the angular frequency w the derivative is too small by (w h)^2 / 6 (order 2) or (w h)^6 / 140
    (order 6), with h the time between the samples it takes."""
    spacing: float = 0.01
    """Least time h [s] between the samples it takes, to the nearest whole number of sampling periods: a log at a higher
    frequency does not make it noisier."""

    def __post_init__(self) -> None:
        require_positive(spacing=self.spacing)
        if self.order not in _WEIGHTS:
            raise SettingError(f"central difference of order {self.order} is unknown; known orders: 2, 6")

    def halo(self, fs: float) -> float:
        """Return half the time the difference spans."""
        return self.order / 2 * self._samples(fs) / fs

    def derivative(self, x: Array, fs: float) -> Array:
        """Return the central difference of `x` over h."""
        samples = self._samples(fs)
        return slide(x, _WEIGHTS[self.order] * (fs / samples), samples)

    def _samples(self, fs: float) -> int:
        return max(1, round(self.spacing * fs))


DIFFERENTIATORS: Table[AbstractDifferentiator] = Table(
    "differentiators",
    AbstractDifferentiator,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {"central": CentralDifference},
)
