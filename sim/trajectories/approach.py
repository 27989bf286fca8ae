"""The way from where the arm is to where a trajectory starts."""

import numpy as np

from sim.errors import ScenarioError
from sim.motors import Array
from sim.robot import Robot
from sim.trajectories.base import require_in_range
from sim.trajectories.reference import Reference
from sim.trajectories.time_optimal import JerkLimited

VELOCITY, ACCELERATION, JERK = 1.0, 5.0, 50.0
"""Limits of a gentle move [rad/s, rad/s^2, rad/s^3]."""

REST = 0.2
"""Time at rest before and after it [s]."""


def approach(robot: Robot, start: Array, goal: Array, fs: float) -> Reference:
    """Return ruckig's move from `start` to `goal` [rad], shape (joint,), gentle, at rest at both ends.

    Raises
    ------
    ScenarioError
        If `start` is not a position of the robot's joints.
    """
    if start.shape != (robot.n,):
        raise ScenarioError(f"start has {start.size} positions, robot {robot.name!r} has {robot.n} joints")
    require_in_range(robot, start[None])
    limits = [np.full(robot.n, x) for x in (VELOCITY, ACCELERATION, JERK)]
    return JerkLimited.between(np.stack([start, goal]), *limits, REST).sample(fs)
