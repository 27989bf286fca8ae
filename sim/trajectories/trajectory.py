"""What a trajectory of a scenario is."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import final

import numpy as np

from idbench.identify.blame import blamed, expect_kind
from idbench.sim.errors import ScenarioError
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot


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
        return self.at(np.arange(round(self.duration * fs)) / fs, fs)


MOST_SAMPLES = 1e8  # Samples of a joint above which a motion is taken for a slip: 0.8 GB
LONGEST = 1e6  # Duration [s] above which a motion is taken for a slip: eleven days


class AbstractTrajectory(ABC):
    """Where the joints shall go, and when."""

    @abstractmethod
    def plan(self, robot: Robot) -> AbstractMotion:
        """Return the motion for `robot`; raise ScenarioError if it makes no sense."""

    @final
    def motion(self, robot: Robot) -> AbstractMotion:
        """Return the motion for `robot`, checked: one that lasts for a while; raise PluginError or ScenarioError if not."""
        with blamed():
            planned = expect_kind(self, "plan", self.plan(robot), AbstractMotion)
        if not 0 <= planned.duration < LONGEST:
            raise ScenarioError(f"the motion lasts {planned.duration:.3g} s: it must be 0 to {LONGEST:.0e} s")
        return planned

    @final
    def sample(self, robot: Robot, fs: float) -> Reference:
        """Return the motion at `fs` [Hz], checked: it moves the robot's joints, inside their ranges.

        Raises
        ------
        ScenarioError
            If it does not, or has no sample, or too many to be meant.
        """
        planned = self.motion(robot)
        # Extremes of smooth moves between waypoints lie at waypoints or a little beyond; 50 Hz finds them to 0.1 %.
        require_in_range(robot, planned.at(np.linspace(0.0, planned.duration, 2 + int(50 * planned.duration)), 50.0).q)
        if not 1 <= planned.duration * fs <= MOST_SAMPLES:
            raise ScenarioError(
                f"fs = {fs:g} Hz makes {planned.duration * fs:.3g} samples of this motion; 1 to {MOST_SAMPLES:.0e} are allowed"
            )
        return planned.sample(fs)


def require_in_range(robot: Robot, q: Array) -> None:
    """Raise ScenarioError if positions [rad], shape (time, joint), are not of the robot's joints, or leave their ranges."""
    if q.shape[1] != robot.n:
        raise ScenarioError(f"the trajectory moves {q.shape[1]} joints, robot {robot.name!r} has {robot.n}")
    for name, x, (low, high) in zip(robot.joints, q.T, robot.ranges, strict=True):
        if x.min() < low or x.max() > high:
            raise ScenarioError(
                f"{name} would move from {x.min():.3g} to {x.max():.3g} rad, its range is {low:.3g} to {high:.3g}"
            )
