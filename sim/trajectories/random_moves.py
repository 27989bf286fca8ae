"""Random point-to-point moves."""

from typing import Annotated, final

import numpy as np
from pydantic import Field

from sim.errors import ScenarioError
from sim.robot import Robot
from sim.settings import EachPositive, NotNegative, Positive, Seed, Whole, per_joint, settings
from sim.trajectories.base import AbstractTrajectory
from sim.trajectories.point_to_point import PEAK_VELOCITY, PointToPoint, at_rest
from sim.trajectories.waypoints import draw_waypoint


@final
@settings
class RandomMoves(AbstractTrajectory):
    """Fifth-order moves between random waypoints in random times."""

    moves: Annotated[Whole, Field(ge=1, le=100000)] = 30
    """Number of moves."""
    durations: tuple[Positive, Positive] = (1.1, 1.55)
    """Shortest and longest time of a move [s]; those between are equally likely."""
    velocity: EachPositive = (7.0,)
    """Largest speed [rad/s], of all joints or of each; a move that would be faster takes longer."""
    rest: NotNegative = 3.0
    """Time at rest before the first and after the last move [s]."""
    clearance: NotNegative = 0.2
    """Distance of waypoints from the ends of the joints' ranges [rad]."""
    smallest_move: Positive = 0.4
    """Least distance that every joint moves [rad]."""
    seed: Seed = 0
    """The same seed gives the same waypoints."""

    def __post_init__(self) -> None:
        if self.durations[0] > self.durations[1]:
            raise ScenarioError(f"durations = {list(self.durations)}: the shortest is above the longest")

    def plan(self, robot: Robot) -> PointToPoint:
        """Draw waypoints and times; every joint moves in every move."""
        rng, points = np.random.default_rng(self.seed), np.zeros((self.moves + 1, robot.n))
        for k in range(self.moves + 1):
            neighbours = points[max(k - 1, 0) : k]
            points[k] = draw_waypoint(rng, robot.ranges, neighbours, self.clearance, self.smallest_move)
        velocity = per_joint(self.velocity, robot.n, "trajectory.velocity")
        fastest = (PEAK_VELOCITY * np.abs(np.diff(points, axis=0)) / velocity).max(axis=1)
        times = np.maximum(rng.uniform(*self.durations, self.moves), fastest)
        return at_rest(points, times, self.rest)
