"""Fifth-order point-to-point moves, given by waypoints and times."""

from typing import final

import numpy as np

from idbench.sim.errors import ScenarioError
from idbench.sim.robot.robot import Robot
from idbench.sim.settings import NotNegative, Positions, Positive, settings
from idbench.sim.trajectories.point_to_point import PointToPoint, at_rest
from idbench.sim.trajectories.trajectory import AbstractTrajectory


@final
@settings
class Quintic(AbstractTrajectory):
    """Fifth-order point-to-point moves between given waypoints in given times."""

    waypoints: Positions = ((0.0, 0.0), (1.0, -1.0))
    """Positions at rest, joint by joint [rad]; at least two."""
    durations: tuple[Positive, ...] = (1.0,)
    """Time of every move [s]; one less than waypoints."""
    rest: NotNegative = 3.0
    """Time at rest before the first and after the last move [s]: filters settle there."""

    def __post_init__(self) -> None:
        if len({len(point) for point in self.waypoints}) != 1 or not self.waypoints[0]:
            raise ScenarioError("waypoints must all have the same number of joints, at least 1")
        if len(self.waypoints) < 2 or len(self.durations) != len(self.waypoints) - 1:
            w, d = len(self.waypoints), len(self.durations)
            raise ScenarioError(f"{w} waypoints need {max(w - 1, 1)} durations, not {d}; at least 2 waypoints are needed")

    @property
    def points(self) -> PointToPoint:
        """The moves, with their rest at both ends."""
        return at_rest(np.array(self.waypoints), np.array(self.durations), self.rest)

    def plan(self, robot: Robot) -> PointToPoint:
        """Return the moves."""
        del robot
        return self.points
