"""Differentiators, and their table."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Literal, final

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.errors import SettingError, require_positive
from idbench.identify.plugins import Table
from idbench.identify.signals.stencils import slide


class AbstractDifferentiator(ABC):
    """The operator s = d/dt on sampled signals, without phase shift."""

    @abstractmethod
    def halo(self, fs: float) -> float:
        """Return how far [s] the derivative looks to either side."""

    @abstractmethod
    def derivative(self, x: Array, fs: float) -> Array:
        """Return dx/dt of `x`, shape (..., time), sampled at `fs` [Hz]."""


_WEIGHTS = {
    2: np.array([-1.0, 0.0, 1.0]) / 2,
    6: np.array([-1.0, 9.0, -45.0, 0.0, 45.0, -9.0, 1.0]) / 60,
}
"""Weights that are exact for polynomials of degree 2 and 6."""


@final
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
    {
        "central": CentralDifference,
    },
)
