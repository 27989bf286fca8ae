"""What the torque samples of a log mean, and how they are put on the time of the columns."""

from identify.signals.torques.alignment import ALIGNMENTS as ALIGNMENTS
from identify.signals.torques.alignment import AsLogged as AsLogged
from identify.signals.torques.alignment import ByChannel as ByChannel
from identify.signals.torques.averaged_torque import AveragedTorque as AveragedTorque
from identify.signals.torques.held_torque import HeldTorque as HeldTorque
from identify.signals.torques.instantaneous_torque import InstantaneousTorque as InstantaneousTorque
from identify.signals.torques.torque import AbstractAlignment as AbstractAlignment
from identify.signals.torques.torque import AbstractTorque as AbstractTorque
