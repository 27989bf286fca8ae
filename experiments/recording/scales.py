"""Scales of charts: where a value lies between the ends of an axis, and which values are written beside it."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np
import numpy.typing as npt

from idbench.experiments.text import decade_values, round_values
from idbench.identify import Array
from idbench.identify.arrays import TINY

ROOM, WIDER = 0.04, 2.0
"""Share of an axis that stays free at either end; how much farther one of decades to both sides reaches than its values."""


@dataclass(frozen=True)
class AbstractScale(ABC):
    """An axis of a chart."""

    name: str
    """What it shows, with its unit."""
    low: float
    """Its lower end."""
    high: float
    """Its upper end."""

    def at(self, x: npt.ArrayLike) -> Array:
        """Places of values, 0 at the low end and 1 at the high one, clipped."""
        low, high = self._bent(np.array([self.low, self.high]))
        return np.clip((self._bent(np.asarray(x, dtype=np.float64)) - low) / ((high - low) or 1.0), 0.0, 1.0)

    def holds(self, x: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """Mask of the values between the ends."""
        low, high = sorted((self.low, self.high))
        return (np.asarray(x) >= low) & (np.asarray(x) <= high)

    @property
    def ticks(self) -> dict[float, str]:
        """Values that are written beside the axis, as text: 1e-5, not 1e-05."""
        values = [v for v in self._values() if self.low <= v <= self.high]
        return {float(v): f"{v:.4g}".replace("e-0", "e-").replace("e+0", "e") for v in values}

    def _bent(self, x: Array) -> Array:
        """Return values as they are spaced: evenly."""
        return x

    @abstractmethod
    def _values(self) -> Array:
        """Return round values that cover the axis."""


@dataclass(frozen=True)
class Linear(AbstractScale):
    """An axis of equal steps."""

    def _values(self) -> Array:
        return round_values(self.low, self.high)


@dataclass(frozen=True)
class Decades(AbstractScale):
    """A logarithmic axis."""

    def _bent(self, x: Array) -> Array:
        return np.log10(np.maximum(x, TINY))

    def _values(self) -> Array:
        return decade_values(self.low, self.high)


@dataclass(frozen=True)
class Signed(AbstractScale):
    """An axis of decades to both sides of 0, linear up to `bend` (inverse hyperbolic sine)."""

    bend: float = 1.0

    def _bent(self, x: Array) -> Array:
        return np.arcsinh(x / self.bend)

    def _values(self) -> Array:
        if (most := int(np.log10(self.high / self.bend))) < 1:
            return round_values(self.low, self.high)
        powers = self.bend * 10.0 ** np.arange(most, 0, -max(1, ceil(most / 2)))  # at bend itself they would touch 0
        return np.concatenate([-powers, [0.0], powers])


@dataclass(frozen=True)
class Words(AbstractScale):
    """An axis of names, at 0, 1, 2 and so on."""

    words: tuple[str, ...] = ()

    def _values(self) -> Array:
        return np.arange(float(len(self.words)))

    @property
    def ticks(self) -> dict[float, str]:
        """The names."""
        return {float(k): word for k, word in enumerate(self.words)}


def linear(name: str, *values: npt.ArrayLike) -> Linear:
    """Return an axis of equal steps that holds all finite values."""
    return Linear(name, *_widened(*_ends(values)))


def decades(name: str, *values: npt.ArrayLike) -> Decades:
    """Return a logarithmic axis that holds all values above 0."""
    low, high = _ends([np.where(np.asarray(x, dtype=np.float64) > 0, x, np.nan) for x in values], 1.0)
    low, high = _widened(*np.log10([low, high])) if low < high else (np.log10(low) - 1, np.log10(low) + 1)
    return Decades(name, 10**low, 10**high)


def signed(name: str, *values: npt.ArrayLike, bend: float) -> Signed:
    """Return an axis of decades to both sides of 0, as far to one as to the other, that holds all finite values."""
    widest = max(map(abs, _ends(values, bend)))
    return Signed(name, -WIDER * max(widest, bend), WIDER * max(widest, bend), bend)


def named(name: str, words: Sequence[str]) -> Words:
    """Return an axis of names."""
    return Words(name, -0.5, len(words) - 0.5, tuple(words))


def listed(name: str, words: Sequence[str]) -> Words:
    """Return an upright axis of names, the first at the top."""
    return Words(name, len(words) - 0.5, -0.5, tuple(words))


def _ends(values: Sequence[npt.ArrayLike], nothing: float = 0.0) -> tuple[float, float]:
    every = np.concatenate([np.ravel(np.asarray(x, dtype=np.float64)) for x in values])
    every = every[np.isfinite(every)]
    return (float(every.min()), float(every.max())) if len(every) else (nothing, nothing)


def _widened(low: float, high: float) -> tuple[float, float]:
    room = ROOM * (high - low) or max(abs(low), 1.0)
    return low - room, high + room
