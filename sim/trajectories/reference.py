"""A planned motion, in closed form and sampled."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import final

import numpy as np

from idbench.sim.robot.motors import Array


@dataclass(frozen=True, eq=False)
class Reference:
    """A planned motion, sampled."""

    fs: float
    """[Hz]."""
    q: Array
    """Positions [rad], shape (time, joint), or (time, nsim, joint) for many simulations."""
    qd: Array
    """Velocities [rad/s], of the same shape."""
    qdd: Array
    """Accelerations [rad/s^2], of the same shape."""


class AbstractMotion(ABC):
    """A planned motion as a function of time, at rest before its start and after its end."""

    @property
    @abstractmethod
    def duration(self) -> float:
        """Time from the first to the last instant, pauses included [s]."""

    @abstractmethod
    def at(self, t: Array, fs: float) -> Reference:
        """Return the motion at the times `t` [s], shape (time,)."""

    @final
    def sample(self, fs: float) -> Reference:
        """Return the motion at t = 0, 1/fs, 2/fs, ... below its duration, exactly."""
        count = round(self.duration * fs)
        return self.at(np.arange(count) / fs, fs)
