"""Putting the torque of a log on the time of the columns, or not."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import final

from identify.arrays import Array
from identify.data.motion_log import Meaning, TorqueChannel
from identify.plugins import PluginTable
from identify.signals.torques.averaged_torque import AveragedTorque
from identify.signals.torques.held_torque import HeldTorque
from identify.signals.torques.instantaneous_torque import InstantaneousTorque
from identify.signals.torques.torque import AbstractAlignment, AbstractTorque

TORQUES: dict[Meaning, Callable[[Array, float, float], AbstractTorque]] = {
    "instantaneous": InstantaneousTorque,
    "held": HeldTorque,
    "averaged": AveragedTorque,
}


@final
@dataclass(frozen=True)
class ByChannel(AbstractAlignment):
    """Takes the torque for what its channel says it is: instantaneous, held or averaged, with its delay."""

    def align(self, tau: Array, channel: TorqueChannel, fs: float) -> AbstractTorque:
        """Return the torque as the class of its meaning."""
        return TORQUES[channel.meaning](tau, channel.delay, fs)


@final
@dataclass(frozen=True)
class AsLogged(AbstractAlignment):
    """Takes sample k for the torque at t_k, whatever the channel says, as the paper does."""

    def align(self, tau: Array, channel: TorqueChannel, fs: float) -> AbstractTorque:
        """Return the torque as if it were instantaneous and not delayed."""
        del channel
        return InstantaneousTorque(tau, 0.0, fs)


ALIGNMENTS: PluginTable[AbstractAlignment] = PluginTable(
    "alignments",
    AbstractAlignment,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {
        "channel": ByChannel,
        "logged": AsLogged,
    },
)
