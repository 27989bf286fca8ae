"""The way from where the arm is to where a trajectory starts."""

import numpy as np

from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.trajectories.reference import Reference
from idbench.sim.trajectories.time_optimal import JerkLimited
from idbench.sim.trajectories.trajectory import require_in_range

VELOCITY = 1.0
ACCELERATION = 5.0
JERK = 50.0
"""Limits of a gentle move [rad/s, rad/s^2, rad/s^3]."""

REST = 0.2
"""Time at rest before and after it [s]."""


def approach(robot: Robot, start: Array, goal: Array, fs: float, most: Array | None = None) -> Reference:
    """Return ruckig's move from `start` to `goal` [rad], shape (joint,), gentle, at rest at both ends.

    No faster than the file of the robot allows, nor than `most` [rad/s, rad/s^2, rad/s^3], shape (3, joint).

    Raises
    ------
    ScenarioError
        If `start` is not a position of the robot's joints.
    """
    require_in_range(robot, start[None])
    known = np.stack([robot.most(rate) for rate in ("velocity", "acceleration", "jerk")])
    limits = np.minimum(known, np.array([[VELOCITY], [ACCELERATION], [JERK]]))
    if most is not None:
        limits = np.minimum(limits, most)
    return JerkLimited.between(np.stack([start, goal]), limits, REST).sample(fs)
