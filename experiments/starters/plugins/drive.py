"""A drive: what stands between the commanded torque and that of the motor."""

import numpy as np

from idbench.sim.drives.drive import AbstractAmplifier, AbstractDrive, Electric, Trace
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.settings import Positive, settings


@settings
class Starter(AbstractDrive):
    """A torque that follows its command with a time constant."""

    time_constant: Positive = 0.002
    """Of the first-order lag [s]."""

    def start(self, robot: Robot, nsim: int, h: float) -> AbstractAmplifier:
        """Return the drive at rest, to be advanced by steps of `h` [s]."""
        return _Amplifier(np.zeros((nsim, robot.n)), -np.expm1(-h / self.time_constant))

    def lag(self, robot: Robot) -> Array:
        """Return the time constant, by which the torque follows a slow command [s]."""
        return np.full(robot.n, self.time_constant)


class _Amplifier(AbstractAmplifier):
    def __init__(self, tau: Array, share: float) -> None:
        self._tau, self._share = tau, share

    def step(self, demand: Array, speed: Array, steps: int) -> Array:
        torques = np.empty((steps, *demand.shape))
        for k in range(steps):
            self._tau = self._tau + self._share * (demand - self._tau)
            torques[k] = self._tau
        return torques

    def electric(self, trace: Trace, dt: Array) -> Electric:
        return Electric(*np.zeros((6, *dt.shape)))
