"""Random point-to-point moves."""

from typing import Annotated, final

import numpy as np
from pydantic import Field

from sim.robot import Robot
from sim.settings import EachPositive, NotNegative, Positive, Seed, Whole, per_joint, settings
from sim.trajectories.base import AbstractTrajectory
from sim.trajectories.point_to_point import PointToPoint
from sim.trajectories.waypoints import draw_waypoint


@final
@settings
class RandomMoves(AbstractTrajectory):
    """Fifth-order moves between random waypoints, the fastest that keep limits of velocity and acceleration."""

    moves: Annotated[Whole, Field(ge=1, le=100000)] = 30
    """Number of moves."""
    velocity: EachPositive = (7.0,)
    """Largest speed [rad/s], of all joints or of each."""
    acceleration: EachPositive = (18.0, 25.0)
    """Largest acceleration [rad/s^2], of all joints or of each."""
    rest: NotNegative = 3.0
    """Time at rest before the first and after the last move [s]."""
    clearance: NotNegative = 0.2
    """Distance of waypoints from the ends of the joints' ranges [rad]."""
    smallest_move: Positive = 0.4
    """Least distance that every joint moves [rad]."""
    seed: Seed = 0
    """The same seed gives the same waypoints."""

    def plan(self, robot: Robot) -> PointToPoint:
        """Draw the waypoints; every joint moves in every move."""
        rng, points = np.random.default_rng(self.seed), np.zeros((self.moves + 1, robot.n))
        for k in range(self.moves + 1):
            neighbours = points[max(k - 1, 0) : k]
            points[k] = draw_waypoint(rng, robot.ranges, neighbours, self.clearance, self.smallest_move)
        dwells = np.zeros(self.moves + 1)
        dwells[[0, -1]] = self.rest
        velocity = per_joint(self.velocity, robot.n, "trajectory.velocity")
        return PointToPoint.fastest(points, velocity, per_joint(self.acceleration, robot.n, "trajectory.acceleration"), dwells)
