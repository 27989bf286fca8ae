"""What the torque samples of a log mean, and how they are put on the time of the columns."""

from idbench.identify.plugins import Table
from idbench.identify.signals.torques.alignment import AsLogged as AsLogged
from idbench.identify.signals.torques.alignment import ByChannel as ByChannel
from idbench.identify.signals.torques.torque import AbstractAlignment as AbstractAlignment
from idbench.identify.signals.torques.torque import Torque as Torque

ALIGNMENTS: Table[AbstractAlignment] = Table(
    "alignments",
    AbstractAlignment,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {
        "channel": ByChannel,
        "logged": AsLogged,
    },
)
