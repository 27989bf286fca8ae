"""Random point-to-point moves."""

from typing import Annotated, final

import numpy as np
from pydantic import Field

from idbench.sim.errors import ScenarioError
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.settings import EachPositive, NotNegative, Positive, Seed, Whole, per_joint, settings
from idbench.sim.trajectories.point_to_point import PEAK_VELOCITY, PointToPoint, at_rest
from idbench.sim.trajectories.trajectory import AbstractTrajectory
from idbench.sim.trajectories.waypoints import draw_waypoint


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
    clearance: NotNegative | None = None
    """Distance of waypoints from the ends of the joints' ranges [rad]; without it 0.2, or a tenth of narrow ranges."""
    smallest_move: Positive | None = None
    """Least distance that every joint moves [rad]; without it 0.4, or a quarter of narrow ranges."""
    seed: Seed = 0
    """The same seed gives the same waypoints."""

    def __post_init__(self) -> None:
        if self.durations[0] > self.durations[1]:
            raise ScenarioError(f"durations = {list(self.durations)}: the shortest is above the longest")

    def plan(self, robot: Robot) -> PointToPoint:
        """Draw waypoints and times; every joint moves in every move."""
        rng, points = np.random.default_rng(self.seed), np.zeros((self.moves + 1, robot.n))
        ranges = room(robot)
        width = np.diff(ranges, axis=1)[:, 0]
        clearance = np.minimum(0.2, width / 10) if self.clearance is None else self.clearance
        smallest = np.minimum(0.4, width / 4) if self.smallest_move is None else self.smallest_move
        for k in range(self.moves + 1):
            neighbours = points[max(k - 1, 0) : k]
            points[k] = draw_waypoint(rng, ranges, neighbours, clearance, smallest)
        velocity = per_joint(self.velocity, robot.n, "trajectory.velocity")
        fastest = (PEAK_VELOCITY * np.abs(np.diff(points, axis=0)) / velocity).max(axis=1)
        times = np.maximum(rng.uniform(*self.durations, self.moves), fastest)
        return at_rest(points, times, self.rest)


def room(robot: Robot) -> Array:
    """Return where joints move at random, shape (joint, 2): their ranges, or half a turn or metre to either side."""
    free = np.where(robot.slides, 0.5, np.pi)
    around = robot.model.qpos0[:, None] + free[:, None] * [-1.0, 1.0]
    return np.where(np.isfinite(robot.ranges), robot.ranges, around)
