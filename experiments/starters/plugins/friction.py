"""A friction of the simulated robot: how its joints resist beside MuJoCo's own Coulomb and viscous friction."""

import numpy as np

from idbench.sim.frictions.friction_law import AbstractContact, AbstractFrictionLaw, PlantJoints
from idbench.sim.robot.motors import Array
from idbench.sim.settings import NotNegative, settings


@settings
class Starter(AbstractFrictionLaw):
    """Coulomb and viscous friction, and drag that grows with the square of the velocity."""

    drag: NotNegative = 0.01
    """Fq [N m s^2/rad^2], of all joints."""

    def start(self, plant: PlantJoints, Fs: Array, h: float) -> AbstractContact:
        """Return the friction at work."""
        return _Contact(self.drag)


class _Contact(AbstractContact):
    def __init__(self, drag: float) -> None:
        self._drag = drag

    def torque(self, qd: Array) -> Array:
        return -self._drag * np.abs(qd) * qd
