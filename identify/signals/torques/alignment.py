"""Putting the torque of a log on the time of the columns, or not."""

from dataclasses import dataclass
from typing import final

from idbench.identify.arrays import Array
from idbench.identify.data.motion_log import TorqueChannel
from idbench.identify.signals.torques.torque import AbstractAlignment, Torque


@final
@dataclass(frozen=True)
class ByChannel(AbstractAlignment):
    """Takes the torque for what its channel says it is: instantaneous, held or averaged, with its delay."""

    def align(self, tau: Array, channel: TorqueChannel, fs: float) -> Torque:
        """Return the torque with its meaning and delay."""
        return Torque(tau, channel.meaning, channel.delay, fs)


@final
@dataclass(frozen=True)
class AsLogged(AbstractAlignment):
    """Takes sample k for the torque at t_k, whatever the channel says, as the paper does."""

    def align(self, tau: Array, channel: TorqueChannel, fs: float) -> Torque:
        """Return the torque as if it were instantaneous and not delayed."""
        del channel
        return Torque(tau, "instantaneous", 0.0, fs)
