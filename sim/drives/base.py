"""What a drive is: what stands between a commanded torque and the torque at the joint."""

from abc import ABC, abstractmethod

import numpy as np

from sim.motors import Array
from sim.robot import Robot


class AbstractAmplifier(ABC):
    """A drive at work; what it remembers is of shape (nsim, joint)."""

    @abstractmethod
    def step(self, demand: Array, speed: Array, steps: int) -> Array:
        """Advance by some physics steps; return the mean torque in them [N m], shape (nsim, joint).

        Parameters
        ----------
        demand : Array, shape (nsim, joint)
            Torque asked for, its mean over the steps [N m].
        speed : Array, shape (nsim, joint)
            Speed in the middle of the steps, times the torque constant over its nominal value [rad/s].
        steps : int
            How many; one unless the drive is steady.
        """


class AbstractDrive(ABC):
    """The settings of a drive."""

    @abstractmethod
    def start(self, robot: Robot, nsim: int, h: float) -> AbstractAmplifier:
        """Return the drive at rest, to be advanced by physics steps of `h` [s].

        Raises
        ------
        RobotError
            If the robot's motors are not described well enough.
        ScenarioError
            If a setting does not fit the motors.
        """

    @abstractmethod
    def lag(self, robot: Robot) -> Array:
        """Return how late the torque follows a slow command [s], shape (joint,)."""

    @property
    @abstractmethod
    def steady(self) -> bool:
        """Whether the torque stays as it is while the demand does, so that many physics steps may be taken at once."""

    def step_length(self, fs: float, longest: float) -> float:
        """Return the physics step [s] that fits whole times into a sample of 1/`fs` and is not above `longest`."""
        return 1 / fs / max(1, int(np.ceil(1 / fs / longest - 1e-9)))
