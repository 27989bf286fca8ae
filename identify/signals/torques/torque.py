"""The torque of a log on the time of the columns, and what puts it there."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import final

from identify.arrays import Array
from identify.data.motion_log import TorqueChannel


@dataclass(frozen=True, eq=False)
class AbstractTorque(ABC):
    """The measured torque as a mean over one window around every sample instant.

    The window is one sampling period for a torque that was averaged, and the instant itself otherwise; `average` puts the
    columns of a model over the same window, so that B tau = [c + s e] X is compared with itself.

    Parameters
    ----------
    tau : Array, shape (..., joint, time)
        Logged torque [N m].
    delay : float
        [s]; what sample k speaks for begins at t_k + delay.
    fs : float
        [Hz]; T = 1/fs.
    """

    tau: Array
    delay: float
    fs: float

    @abstractmethod
    def halo(self) -> float:
        """Return how far [s] the mean torque looks to either side."""

    @cached_property
    def mean(self) -> Array:
        """Mean torque over the window of every sample, shape (..., joint, time) [N m]."""
        return self._mean()

    @final
    def times(self, x: Array | float, joint: int) -> Array:
        """Return the mean of `x`, shape (..., time) or constant, times a joint's torque, over the window of every sample."""
        tau = self.mean[..., joint, :]
        return x * tau if isinstance(x, float) else self.average(x) * tau + self._covariance(x, tau)

    @abstractmethod
    def average(self, x: Array) -> Array:
        """Return the mean of `x`, shape (..., time), over the window of every sample."""

    @abstractmethod
    def _mean(self) -> Array:
        """Return the mean torque over the window of every sample."""

    @abstractmethod
    def _covariance(self, x: Array, tau: Array) -> Array | float:
        """Return the mean of a product over the window of every sample, less the product of the means."""


class AbstractAlignment(ABC):
    """How the torque of a log is read."""

    @abstractmethod
    def align(self, tau: Array, channel: TorqueChannel, fs: float) -> AbstractTorque:
        """Return the torque `tau` [N m], shape (..., joint, time), of `channel`, on the time of the columns."""
