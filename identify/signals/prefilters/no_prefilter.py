"""No prefilter."""

from dataclasses import dataclass
from typing import final

from idbench.identify.arrays import Array
from idbench.identify.signals.prefilters.prefilter import AbstractPrefilter


@final
@dataclass(frozen=True)
class NoPrefilter(AbstractPrefilter):
    """Leaves positions and torques as they were logged."""

    def halo(self, fs: float) -> float:
        """Return 0."""
        del fs
        return 0.0

    def apply(self, x: Array, fs: float) -> Array:
        """Return `x`."""
        del fs
        return x
