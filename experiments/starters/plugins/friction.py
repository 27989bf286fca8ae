"""A friction of the simulated robot: how its joints resist beside MuJoCo's own Coulomb and viscous friction."""

from typing import final

import numpy as np
from mujoco.batch import Batch

from idbench.sim.frictions.friction_law import AbstractContact, AbstractFrictionLaw
from idbench.sim.robot.motors import Array
from idbench.sim.settings import EachNotNegativeOrNone, NotNegative, settings


@final
@settings
class Starter(AbstractFrictionLaw):
    """Coulomb and viscous friction, and drag that grows with the square of the velocity."""

    viscous: EachNotNegativeOrNone = None
    """Fv [N m s/rad], of all joints or of each; without it the robot's own."""
    coulomb: EachNotNegativeOrNone = None
    """Fs [N m], of all joints or of each; without it the robot's own."""
    drag: NotNegative = 0.01
    """Fq [N m s^2/rad^2], of all joints."""

    @property
    def steady(self) -> bool:
        """False: the torque changes from step to step."""
        return False

    def start(self, plant: Batch, Fs: Array, h: float) -> AbstractContact:
        """Return the friction at work."""
        del plant, Fs, h
        return _Contact(self.drag)


class _Contact(AbstractContact):
    def __init__(self, drag: float) -> None:
        self._drag = drag

    def torque(self, qd: Array) -> Array:
        return -self._drag * np.abs(qd) * qd
