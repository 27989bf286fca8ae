"""Prefilters of positions and torques, and their table."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import lru_cache
from typing import final

import scipy

from idbench.identify.arrays import Array, frozen
from idbench.identify.errors import require_below_nyquist, require_positive, require_whole
from idbench.identify.plugins import Table
from idbench.identify.signals.stencils import forward_backward, settling_time


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


@final
@dataclass(frozen=True)
class ButterworthPrefilter(AbstractPrefilter):
    """Butterworth low-pass, run forward and backward (section 6.2, Matlab's filtfilt)."""

    cutoff: float = 8.0
    """Cut-off frequency f_fq [Hz] of one pass; both together attenuate it by 6 dB. The paper's rule of thumb is more than 10
    times the bandwidth of the robot's dynamics."""
    order: int = 4
    """Order of one pass, above 2 so that s^2 f_fq(s) still rejects high frequencies."""

    def __post_init__(self) -> None:
        require_positive(cutoff=self.cutoff)
        require_whole(3, order=self.order)

    def halo(self, fs: float) -> float:
        """Return the settling time of one pass."""
        return _halo(self, fs)

    def apply(self, x: Array, fs: float) -> Array:
        """Return `x` filtered forward and backward."""
        return forward_backward(_sections(self, fs), x)


@lru_cache(maxsize=16)
def _sections(f: ButterworthPrefilter, fs: float) -> Array:
    require_below_nyquist("prefilter cutoff", f.cutoff, fs)
    return frozen(scipy.signal.butter(f.order, f.cutoff, fs=fs, output="sos"))


@lru_cache(maxsize=16)
def _halo(f: ButterworthPrefilter, fs: float) -> float:
    return settling_time(_sections(f, fs), fs)


PREFILTERS: Table[AbstractPrefilter] = Table(
    "prefilters",
    AbstractPrefilter,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {
        "none": NoPrefilter,
        "butterworth": ButterworthPrefilter,
    },
)
