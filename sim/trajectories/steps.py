"""Random steps and waves: what makes servos show themselves."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
import numpy.typing as npt
from pydantic import Field

from idbench.sim.errors import ScenarioError
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.settings import NotNegative, Positive, Seed, Share, Truth, Whole, settings
from idbench.sim.trajectories.point_to_point import PointToPoint
from idbench.sim.trajectories.quintic import draw_waypoint, room
from idbench.sim.trajectories.trajectory import AbstractMotion, AbstractTrajectory, Reference


@settings
class RandomSteps(AbstractTrajectory):
    """Commands that jump to random positions and hold them there; some approach them by fifth-order moves instead."""

    steps: Annotated[Whole, Field(ge=1, le=100000)] = 24
    """Number of positions."""
    holds: tuple[Positive, Positive] = (0.7, 1.4)
    """Shortest and longest time of each [s]; those between are equally likely."""
    moves: Share = 0.5
    """Share of positions that are approached by a move, instead of a jump."""
    pause: NotNegative = 0.3
    """Time at rest at the end of a move [s]; a move takes at least half of its time."""
    rest: NotNegative = 0.5
    """Time at rest before the first [s]."""
    reach: Annotated[float, Field(gt=0, le=1)] = 0.6
    """Share of the joints' ranges, about their middle, that is used; of joints without ends, of a turn."""
    smallest_step: Share = 0.15
    """Least change of every joint, as a share of the part that is used."""
    together: Truth = True
    """Whether all joints move at once; otherwise one after the other, while the others hold."""
    seed: Seed = 0
    """The same seed gives the same positions and times."""

    def __post_init__(self) -> None:
        if self.holds[0] > self.holds[1]:
            raise ScenarioError(f"holds = {list(self.holds)}: the shortest is above the longest")

    def plan(self, robot: Robot) -> AbstractMotion:
        """Draw positions and times."""
        rng, ends = np.random.default_rng(self.seed), room(robot)
        middle, width = ends.mean(axis=1), self.reach * np.diff(ends, axis=1)[:, 0]
        used = np.stack([middle - width / 2, middle + width / 2], axis=1)
        points = np.tile(middle, (self.steps + 1, 1))
        for k in range(1, self.steps + 1):
            drawn = draw_waypoint(rng, used, points[k - 1 : k], 0.0, self.smallest_step * width)
            points[k] = np.where(self.together or np.arange(robot.n) == (k - 1) % robot.n, drawn, points[k - 1])
        times = rng.uniform(*self.holds, self.steps)
        times *= np.mean(self.holds) / times.mean()  # so that all motions of a study are equally long
        moves = rng.random(self.steps) < self.moves
        pauses = np.minimum(self.pause, times / 2)
        return _Steps(PointToPoint(points, times - pauses, np.append(self.rest, pauses)), moves)


@dataclass(frozen=True, eq=False)
class _Steps(AbstractMotion):
    """Moves of which some are jumps to their ends."""

    whole: PointToPoint
    moves: npt.NDArray[np.bool_]

    @property
    def duration(self) -> float:
        return self.whole.duration

    def at(self, t: Array, fs: float) -> Reference:
        whole = self.whole
        planned, start = whole.at(t, fs), whole.dwells[:-1].cumsum() + np.append(0.0, whole.durations[:-1].cumsum())
        k = np.searchsorted(start, t + 1e-9, side="right") - 1
        jumps = (k >= 0) & ~self.moves[np.maximum(k, 0)]
        q = np.where(jumps[:, None], whole.waypoints[np.maximum(k, 0) + 1], planned.q)
        return Reference(fs, q, *(np.where(jumps[:, None], 0.0, x) for x in (planned.qd, planned.qdd)))
