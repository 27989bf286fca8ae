"""What a prefilter is."""

from abc import ABC, abstractmethod

from idbench.identify.arrays import Array


class AbstractPrefilter(ABC):
    """A zero-phase filter of positions and torques, before anything is derived from them (section 6.2)."""

    @abstractmethod
    def halo(self, fs: float) -> float:
        """Return how far [s] the output looks to either side."""

    @abstractmethod
    def apply(self, x: Array, fs: float) -> Array:
        """Return `x`, shape (..., time), filtered along time without phase shift.

        Raises
        ------
        SettingError
            If a setting does not fit `fs`.
        LogError
            If there are fewer samples than the filter needs.
        """
