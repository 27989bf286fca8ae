"""What the torque samples of a log mean, and how they are put on the time of the columns."""

from identify.torques.alignment import ALIGNMENTS as ALIGNMENTS
from identify.torques.alignment import AbstractAlignment as AbstractAlignment
from identify.torques.alignment import AsLogged as AsLogged
from identify.torques.alignment import ByChannel as ByChannel
from identify.torques.averaged import AveragedTorque as AveragedTorque
from identify.torques.base import AbstractTorque as AbstractTorque
from identify.torques.held import HeldTorque as HeldTorque
from identify.torques.instantaneous import InstantaneousTorque as InstantaneousTorque
