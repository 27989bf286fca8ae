"""What a differentiator is."""

from abc import ABC, abstractmethod

from idbench.identify.arrays import Array


class AbstractDifferentiator(ABC):
    """The operator s = d/dt on sampled signals, without phase shift."""

    @abstractmethod
    def halo(self, fs: float) -> float:
        """Return how far [s] the derivative looks to either side."""

    @abstractmethod
    def derivative(self, x: Array, fs: float) -> Array:
        """Return dx/dt of `x`, shape (..., time), sampled at `fs` [Hz]."""
