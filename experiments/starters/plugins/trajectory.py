"""A trajectory: where the joints go, and when."""

import numpy as np

from idbench.sim.robot.robot import Robot
from idbench.sim.settings import Positive, settings
from idbench.sim.trajectories.point_to_point import PointToPoint, at_rest
from idbench.sim.trajectories.trajectory import AbstractTrajectory


@settings
class Starter(AbstractTrajectory):
    """All joints there and back, between a quarter and three quarters of their ranges."""

    duration: Positive = 1.5
    """Time of a move [s]."""
    rest: Positive = 3.0
    """Time at rest at both ends [s]: filters settle there."""

    def plan(self, robot: Robot) -> PointToPoint:
        """Return fifth-order moves, with their rest at both ends."""
        low, high = np.asarray(robot.ranges).T
        low, high = np.where(np.isfinite(low), low, -np.pi), np.where(np.isfinite(high), high, np.pi)
        near, far = low + (high - low) / 4, high - (high - low) / 4
        return at_rest(np.stack([near, far, near]), np.full(2, self.duration), self.rest)
