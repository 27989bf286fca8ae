"""Dahl friction."""

from typing import final

from mujoco.batch import Batch

from idbench.sim.frictions.friction_law import AbstractContact, AbstractFrictionLaw
from idbench.sim.frictions.lugre import LuGre
from idbench.sim.robot.motors import Array
from idbench.sim.settings import EachNotNegativeOrNone, Positive, settings


@final
@settings
class Dahl(AbstractFrictionLaw):
    """Dahl: bristles that bend and slip, Coulomb friction with hysteresis (P. Dahl, AIAA Journal 14 (1976) 1675-1682).

    dz/dt = qd - |qd| z / deflection, torque = Fs z / deflection + Fv qd: LuGre friction without stiction or damping.
    """

    deflection: Positive = 1e-3
    """Bristle deflection at which Fs is reached [rad]: stiffness is Fs over it."""
    viscous: EachNotNegativeOrNone = None
    """Fv [N m s/rad], of all joints or of each; without it the robot's own."""
    coulomb: EachNotNegativeOrNone = None
    """Fs [N m], of all joints or of each; without it the robot's own."""

    @property
    def steady(self) -> bool:
        """False."""
        return False

    def start(self, plant: Batch, Fs: Array, h: float) -> AbstractContact:
        """Return unbent bristles."""
        return LuGre(deflection=self.deflection, damping=0.0, static=1.0).start(plant, Fs, h)
