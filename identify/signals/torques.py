"""What the torque samples of a log mean, and how they are put on the time of the columns."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.data.motion_log import Meaning, TorqueChannel
from idbench.identify.plugins import Table
from idbench.identify.signals.filters import REACH, averaged, shift, slide

_DIFFERENCE = np.array([-0.5, 0.0, 0.5])  # of two neighbours, over two periods


class Reading(NamedTuple):
    """What a torque sample says about the time around it, in sampling periods T = 1/fs."""

    middle: float
    """Where the middle of what it speaks for lies after t_k + delay [T]."""

    torque: float
    """Variance of the window over which the aligned torque is to be averaged [T^2]: 1/12 for a period."""

    columns: float
    """Variance of the window over which the columns of a model are to be averaged [T^2]."""


READINGS: dict[Meaning, Reading] = {
    "instantaneous": Reading(0.0, 0.0, 0.0),
    "held": Reading(0.5, 1 / 12, 0.0),
    "averaged": Reading(0.5, 0.0, 1 / 12),
}
"""A torque that was averaged is compared with columns averaged over the same period. What a sampled motion shows of a held one,
a staircase, is its content below fs/2: the samples, T/2 later, smoothed by the hold, whose gain sin(w T/2) / (w T/2) is that of
a mean over one period; the columns stay as they are. (To average staircase and columns over one period instead takes the
accelerations for smooth within it, which they are not: an error of (w T)^2 times 1/24 - (1/2 - delay/T)^2 / 2.) T is the
sampling period, or that of the controller: `TorqueChannel.period`."""


@dataclass(frozen=True, eq=False)
class Torque:
    """The measured torque at every sample instant, so that B tau = [c + s e] X is compared with itself."""

    tau: Array
    """Logged torque [N m], shape (..., joint, time)."""
    meaning: Meaning
    """What a sample means, as `TorqueChannel` has it."""
    delay: float
    """[s]; what sample k speaks for begins at t_k + delay."""
    fs: float
    """[Hz]."""
    period: float | None = None
    """Time [s] over which it is held or averaged; by default the sampling period."""
    lags: tuple[float, ...] = ()
    """What each joint is late beyond the delay [s], optional."""

    @cached_property
    def _reading(self) -> Reading:
        plain, ratio = READINGS[self.meaning], 1.0 if self.period is None else self.period * self.fs
        ratio = min(ratio, 1.0) if self.meaning == "held" else ratio
        return Reading(plain.middle * ratio, plain.torque * ratio**2, plain.columns * ratio**2)

    @property
    def _late(self) -> float:
        """Samples by which the middle of what a sample speaks for is late."""
        return self.delay * self.fs + self._reading.middle

    def halo(self) -> float:
        """Reach of the mean torque and averaged columns to either side [s]."""
        moved, window = self._late != 0 or any(self.lags), self._reading.torque + self._reading.columns > 0
        return abs(self.delay) + max(map(abs, self.lags), default=0.0) + ((REACH + 1) * moved + window) / self.fs

    @cached_property
    def mean(self) -> Array:
        """Mean torque over the window of every sample, shape (..., joint, time) [N m]."""
        late = [self._late + lag * self.fs for lag in self.lags]
        moved = [shift(self.tau[..., j, :], -samples) for j, samples in enumerate(late)]
        return averaged(np.stack(moved, axis=-2) if moved else shift(self.tau, -self._late), self._reading.torque)

    def average(self, x: Array) -> Array:
        """Return the mean of `x`, shape (..., time), over the window of every sample, to fourth order."""
        return averaged(x, self._reading.columns)

    def times(self, x: Array | float, joint: int) -> Array:
        """Return the mean of `x`, shape (..., time) or constant, times a joint's torque, over the window of every sample."""
        tau = self.mean[..., joint, :]
        if isinstance(x, float) or not self._reading.columns:
            return x * tau
        covariance = self._reading.columns * slide(tau, _DIFFERENCE) * slide(x, _DIFFERENCE)
        return self.average(x) * tau + covariance


class AbstractAlignment(ABC):
    """How the torque of a log is read."""

    @abstractmethod
    def align(self, tau: Array, channel: TorqueChannel, fs: float) -> Torque:
        """Return the torque `tau` [N m], shape (..., time), of `channel`, on the time of the columns.

        It acts along the last axis alone: leading axes may be joints, runs, or none, and an array may be empty.
        """


@dataclass(frozen=True)
class ByChannel(AbstractAlignment):
    """Takes the torque for what its channel says it is: instantaneous, held or averaged, with its delay."""

    def align(self, tau: Array, channel: TorqueChannel, fs: float) -> Torque:
        """Return the torque with its meaning and delay."""
        return Torque(tau, channel.meaning, channel.delay, fs, channel.period, channel.lags)


@dataclass(frozen=True)
class AsLogged(AbstractAlignment):
    """Takes sample k for the torque at t_k, whatever the channel says, as the paper does."""

    def align(self, tau: Array, channel: TorqueChannel, fs: float) -> Torque:
        """Return the torque as if it were instantaneous and not delayed."""
        return Torque(tau, "instantaneous", 0.0, fs)


ALIGNMENTS: Table[AbstractAlignment] = Table(
    "alignments",
    AbstractAlignment,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {"channel": ByChannel, "logged": AsLogged},
)
