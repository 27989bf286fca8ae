"""Prefilters of positions and torques, and their table."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from math import ceil
from typing import final

import numpy as np
import scipy

from idbench.identify.arrays import Array, frozen
from idbench.identify.errors import require_below_nyquist, require_positive, require_whole
from idbench.identify.plugins import Table
from idbench.identify.signals.filters import forward_backward, settling_time, slide

SLOW = 0.05  # Share of a joint's rms speed up to which it counts as turning: 0.1 rad/s of the SCARA's 2 rad/s

NOISY = 4.0  # Standard deviations of the noise of velocities up to which their sign is not known

THIRD = 3  # Order of the differences of velocities in which motion vanishes beside noise

QUIET = 0.8  # Quantile of the absolute third differences of velocities that measures their noise: most of any motion is smooth


def velocity_noise(qd: Array) -> Array:
    """Standard deviation of white noise in velocities of shape (..., time), from their third differences; 0 of too few."""
    if qd.shape[-1] <= THIRD:
        return np.zeros(qd.shape[:-1])
    kinks = np.abs(np.diff(qd, THIRD, axis=-1))
    size = scipy.special.ndtri((1 + QUIET) / 2) * np.sqrt(scipy.special.comb(2 * THIRD, THIRD))
    return np.asarray(np.quantile(kinks, QUIET, axis=-1) / size)


NOISE_SHARE = 1e-3
"""Noise of velocities, over their rms, from which on positions are filtered. A SCARA with 16 bits has 1.8e-3, with 18 bits
4e-4, a KR300 5e-4, a UR10e 5e-3, a Baxter 0.1: with half or double, the gain at 17 bits comes or goes."""


class AbstractPrefilter(ABC):
    """A zero-phase filter of positions and torques, before anything is derived from them (section 6.2)."""

    def suited(self, qd: Callable[[], Array], fs: float) -> "AbstractPrefilter":
        """Filter for a log whose unfiltered velocities, shape (..., joint, time) [rad/s], `qd` returns; itself by default."""
        del qd, fs
        return self

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
    """Order of one pass; by the rule above 2, so that s^2 f_fq(s) rejects high frequencies (section 6.3)."""

    def __post_init__(self) -> None:
        require_positive(cutoff=self.cutoff)
        require_whole(1, order=self.order)

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


@final
@dataclass(frozen=True)
class FirPrefilter(AbstractPrefilter):
    """Sinc through a Kaiser window, whose memory ends; above the Nyquist frequency nothing is filtered."""

    cutoff: float = 15.0
    """Frequency [Hz] at which it attenuates by 6 dB."""

    def __post_init__(self) -> None:
        require_positive(cutoff=self.cutoff)

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
    if cutoff >= fs / 2:
        return frozen(np.ones(1))
    half = ceil(PERIODS * fs / cutoff - 1e-9)
    weights = np.sinc(2 * cutoff / fs * np.arange(-half, half + 1)) * np.kaiser(2 * half + 1, BETA)
    return frozen(weights / weights.sum())


@final
@dataclass(frozen=True)
class NoisePrefilter(AbstractPrefilter):
    """Low-pass of logs whose positions are noisy (`FirPrefilter`); none of others.

    A mask that multiplies differentiated encoder counts shifts their noise from high frequencies into the band of the rows. A
    low-pass before the mask removes it first: with encoders of 14 and 16 bits the errors of the parameters fall by a third to a
    half. Without noise there is nothing to gain, but a bias of some 0.02 % and rows at the ends of short logs to lose.
    """

    cutoff: float = 15.0
    """Cut-off frequency [Hz], three times that of the rows: with twice theirs noise falls a little more, but the bias is three
    times as large; with four times theirs it is the other way round."""

    def __post_init__(self) -> None:
        require_positive(cutoff=self.cutoff)

    def suited(self, qd: Callable[[], Array], fs: float) -> AbstractPrefilter:
        """Low-pass if the noise of any joint's velocity is above `NOISE_SHARE`, none otherwise."""
        del fs
        v = qd()
        noisy = bool((velocity_noise(v) > NOISE_SHARE * np.sqrt(np.mean(v**2, axis=-1))).any())
        return FirPrefilter(self.cutoff) if noisy else NoPrefilter()

    def halo(self, fs: float) -> float:
        """Half the length of the impulse response [s]."""
        return FirPrefilter(self.cutoff).halo(fs)

    def apply(self, x: Array, fs: float) -> Array:
        """Filtered signal."""
        return FirPrefilter(self.cutoff).apply(x, fs)


PREFILTERS: Table[AbstractPrefilter] = Table(
    "prefilters",
    AbstractPrefilter,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {
        "none": NoPrefilter,
        "butterworth": ButterworthPrefilter,
        "fir": FirPrefilter,
        "noise": NoisePrefilter,
    },
)
