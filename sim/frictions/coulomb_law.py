"""Coulomb and viscous friction, by MuJoCo."""

from typing import final

from mujoco.batch import Batch

from idbench.sim.frictions.friction_law import AbstractContact, AbstractFrictionLaw
from idbench.sim.robot.motors import Array
from idbench.sim.settings import EachNotNegativeOrNone, settings


@final
@settings
class CoulombViscous(AbstractFrictionLaw):
    """Fs sign(qd) + Fv qd; near standstill MuJoCo's soft constraint decides."""

    viscous: EachNotNegativeOrNone = None
    """Fv [N m s/rad], of all joints or of each; without it the robot's own."""
    coulomb: EachNotNegativeOrNone = None
    """Fs [N m], of all joints or of each; without it the robot's own."""

    @property
    def steady(self) -> bool:
        """True."""
        return True

    def start(self, plant: Batch, Fs: Array, h: float) -> AbstractContact:
        """Return nothing more than MuJoCo's."""
        del plant, Fs, h
        return _Contact()


class _Contact(AbstractContact):
    def torque(self, qd: Array) -> Array | float:
        del qd
        return 0.0
