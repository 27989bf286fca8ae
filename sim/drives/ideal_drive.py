"""A drive that gives the commanded torque."""

from typing import ClassVar

import numpy as np

from idbench.sim.drives.drive import AbstractAmplifier, AbstractCompiledAmplifier, AbstractDrive, Electric, Trace
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.settings import settings


@settings
class IdealDrive(AbstractDrive):
    """Torque as asked: no winding, no limit, no lag."""

    has_own_motors: ClassVar[bool] = True
    steady: ClassVar[bool] = True

    def start(self, robot: Robot, nsim: int, h: float) -> AbstractAmplifier:
        """Return the drive."""
        return _Amplifier("ideal_drive", (nsim, robot.n), ())

    def lag(self, robot: Robot) -> Array:
        """Return zeros."""
        return np.zeros(robot.n)


class _Amplifier(AbstractCompiledAmplifier):
    def electric(self, trace: Trace, dt: Array) -> Electric:
        return Electric(*np.zeros((6, *dt.shape)))
