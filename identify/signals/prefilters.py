"""Prefilters of positions and torques, and their table."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from math import ceil

import numpy as np
import scipy

from idbench.identify.arrays import Array, frozen
from idbench.identify.data.jumps import velocity_noise
from idbench.identify.errors import require_below_nyquist, require_not_negative, require_positive, require_whole
from idbench.identify.plugins import Table
from idbench.identify.signals.filters import forward_backward, settling_time, slide


class AbstractPrefilter(ABC):
    """A zero-phase filter of positions and torques, before anything is derived from them (section 6.2)."""

    def suited(self, qd: Callable[[], Array]) -> "AbstractPrefilter":
        """Filter for a log whose unfiltered velocities, shape (..., joint, time) [rad/s], `qd` returns; itself by default."""
        return self

    def halo(self, fs: float) -> float:
        """How far the output looks to either side [s]; 0 by default."""
        return 0.0

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


@dataclass(frozen=True)
class NoPrefilter(AbstractPrefilter):
    """Leaves positions and torques as they were logged."""

    def apply(self, x: Array, fs: float) -> Array:
        """Return `x`."""
        return x


@dataclass(frozen=True)
class ButterworthPrefilter(AbstractPrefilter):
    """Butterworth low-pass, run forward and backward (section 6.2, Matlab's filtfilt)."""

    cutoff: float = 8.0
    """Cut-off frequency f_fq [Hz] of one pass; both together attenuate it by 6 dB. The paper's rule of thumb is more than 10
    times the bandwidth of the robot's dynamics."""
    order: int = 4
    """Order of one pass; by the rule above 2, so that s^2 f_fq(s) rejects high frequencies (section 6.3)."""

    def __post_init__(self) -> None:
        require_positive(cutoff=self.cutoff)
        require_whole(1, order=self.order)

    def halo(self, fs: float) -> float:
        """Return the settling time of one pass."""
        return settling_time(_sections(self, fs), fs)

    def apply(self, x: Array, fs: float) -> Array:
        """Return `x` filtered forward and backward."""
        return forward_backward(_sections(self, fs), x)


@lru_cache(maxsize=16)
def _sections(f: ButterworthPrefilter, fs: float) -> Array:
    require_below_nyquist("prefilter cutoff", f.cutoff, fs)
    return frozen(scipy.signal.butter(f.order, f.cutoff, fs=fs, output="sos"))


@dataclass(frozen=True)
class NoisePrefilter(AbstractPrefilter):
    """Low-pass, a sinc through a Kaiser window, of logs whose positions are noisy; none of others.

    A mask that multiplies differentiated encoder counts shifts their noise from high frequencies into the band of the rows. A
    low-pass before the mask removes it: errors with 14 and 16 bits fall by a third to a half. Without noise there is nothing to
    gain, but a bias of some 0.02 % and rows at the ends of short logs to lose.
    """

    cutoff: float = 15.0
    """Frequency [Hz] at which it attenuates by 6 dB, three times that of the rows: with twice theirs noise falls a little more,
    but the bias is three times as large; with four times it is the other way round. Nothing above the Nyquist frequency."""
    least: float = 1e-3
    """Noise of velocities, over their rms, from which on a log is filtered: 1.8e-3 on a SCARA with 16 bits, 4e-4 with 18, 5e-4
    on a KR300, 5e-3 on a UR10e, 0.1 on a Baxter. With half or double, the gain at 17 bits comes or goes."""

    def __post_init__(self) -> None:
        require_positive(cutoff=self.cutoff)
        require_not_negative(least=self.least)

    def suited(self, qd: Callable[[], Array]) -> AbstractPrefilter:
        """Filter of any log if the noise of a joint's velocity is above `least`, none otherwise."""
        if self.least and not (velocity_noise(v := qd()) > self.least * np.sqrt(np.mean(v**2, axis=-1))).any():
            return NoPrefilter()
        return replace(self, least=0.0)

    def halo(self, fs: float) -> float:
        """Half the length of the impulse response [s]."""
        return (len(_taps(self.cutoff, fs)) - 1) / 2 / fs

    def apply(self, x: Array, fs: float) -> Array:
        """Filtered signal."""
        return slide(x, _taps(self.cutoff, fs))


PERIODS, BETA = 2.5, 10.0
"""Periods of the cut-off frequency that the filter looks to either side, and the shape of its window: a stop band of -100 dB.
With -74 dB (Blackman) errors of some logs with 16 bits are three times as large: counts are differentiated twice after it."""


@lru_cache(maxsize=16)
def _taps(cutoff: float, fs: float) -> Array:
    half = ceil(PERIODS * fs / cutoff - 1e-9) if cutoff < fs / 2 else 0
    weights = np.sinc(2 * cutoff / fs * np.arange(-half, half + 1)) * np.kaiser(2 * half + 1, BETA)
    return frozen(weights / weights.sum())


PREFILTERS: Table[AbstractPrefilter] = Table(
    "prefilters",
    AbstractPrefilter,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {"none": NoPrefilter, "butterworth": ButterworthPrefilter, "noise": NoisePrefilter},
)
