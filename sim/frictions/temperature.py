"""Friction that changes as the drives warm up."""

from typing import final

import numpy as np
from mujoco.batch import Batch

from idbench.sim.frictions.friction_law import AbstractContact, AbstractFrictionLaw
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.settings import EachNotNegativeOrNone, EachNumber, Number, Positive, per_joint, settings


@final
@settings
class Warming(AbstractFrictionLaw):
    """Fs sign(qd) + (Fv + slope (T - reference)) qd while the drives warm up from `cold` to `warm`; T is in the log."""

    slope: EachNumber = (-0.001,)
    """Change of Fv with the temperature [N m s/rad/K], of all joints or of each."""
    reference: Number = 45.0
    """Temperature at which Fv is what the robot has [deg C]."""
    cold: Number = 25.0
    """Temperature at the beginning [deg C]."""
    warm: Number = 45.0
    """Temperature in the end [deg C]."""
    time: Positive = 60.0
    """Time constant of the warming [s]."""
    viscous: EachNotNegativeOrNone = None
    """Fv [N m s/rad], of all joints or of each; without it the robot's own."""
    coulomb: EachNotNegativeOrNone = None
    """Fs [N m], of all joints or of each; without it the robot's own."""

    @property
    def steady(self) -> bool:
        """False."""
        return False

    def truth(self, robot: Robot) -> dict[str, float]:
        """Return FvT."""
        return {f"FvT{j + 1}": float(x) for j, x in enumerate(per_joint(self.slope, robot.n, "friction.slope"))}

    def conditions(self, t: Array, n: int) -> dict[str, Array]:
        """Return the temperature, the same of all joints."""
        return {"temperature": np.tile(self.at(t)[:, None], n)}

    def at(self, t: Array | float) -> Array:
        """Return the temperature at instants t [s]."""
        return np.asarray(self.warm + (self.cold - self.warm) * np.exp(-np.asarray(t) / self.time))

    def start(self, plant: Batch, Fs: Array, h: float) -> AbstractContact:
        """Return what the temperature adds."""
        del plant
        return _Contact(self, per_joint(self.slope, Fs.shape[-1], "friction.slope"), h)


class _Contact(AbstractContact):
    def __init__(self, settings: Warming, slope: Array, h: float) -> None:
        self._settings, self._slope, self._h, self._steps = settings, slope, h, 0

    def torque(self, qd: Array) -> Array | float:
        above = self._settings.at((self._steps + 0.5) * self._h) - self._settings.reference
        self._steps += 1
        found: Array = -self._slope * above * qd
        return found
