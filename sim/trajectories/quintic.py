"""Fifth-order point-to-point moves, given by waypoints and times."""

from typing import Annotated

import numpy as np
import numpy.typing as npt
from pydantic import Field

from idbench.sim.errors import ScenarioError
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.settings import EachPositive, NotNegative, Positions, Positive, Seed, Whole, per_joint, settings
from idbench.sim.trajectories.point_to_point import PEAK_VELOCITY, PointToPoint, at_rest
from idbench.sim.trajectories.trajectory import AbstractTrajectory


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
        return self.points


DRAWS = 10000  # Draws of all joints, and then of single ones, after which no waypoint is believed to exist
BLOCK = 50  # Draws that are looked at together


def _far(points: Array, neighbours: Array, smallest_move: Array | float) -> npt.NDArray[np.bool_]:
    """Mask of the joints of points, shape (draw, joint), that are far enough from all neighbours, of the same shape."""
    return np.asarray((np.abs(neighbours - points[:, None]) >= smallest_move).all(axis=1))


def draw_waypoint(
    rng: np.random.Generator, ranges: Array, neighbours: Array, clearance: Array | float, smallest_move: Array | float
) -> Array:
    """Return a random waypoint [rad], shape (joint,).

    Parameters
    ----------
    rng : numpy.random.Generator
    ranges : Array, shape (joint, 2)
        Lowest and highest position [rad].
    neighbours : Array, shape (any, joint)
        Waypoints before and after it; every joint moves at least `smallest_move` [rad] from and to them.
    clearance, smallest_move : float or Array, shape (joint,)
        Distance from the ends of the ranges, and of a move [rad], of all joints or of each.

    Raises
    ------
    ScenarioError
        If there is no such waypoint.
    """
    low, high = ranges[:, 0] + clearance, ranges[:, 1] - clearance
    if (low < high).all() and np.isfinite(ranges).all():
        for _ in range(DRAWS // BLOCK):
            before = rng.bit_generator.state
            right = _far(rng.uniform(low, high, (BLOCK, len(ranges))), neighbours, smallest_move).all(axis=-1)
            if right.any():
                rng.bit_generator.state = before  # which has drawn no more than it took
                return np.asarray(rng.uniform(low, high, (int(right.argmax()) + 1, len(ranges)))[-1])
        # All joints of a hand are seldom right in one draw: those that are wrong are drawn again.
        point = rng.uniform(low, high)
        for _ in range(DRAWS):
            far = _far(point[None], neighbours, smallest_move)[0]
            if far.all():
                return point
            point = np.where(far, point, rng.uniform(low, high))
    narrow = int(np.argmin(high - low))
    raise ScenarioError(
        f"no waypoint is {np.max(smallest_move):g} rad from its neighbours and {np.max(clearance):g} rad inside the ranges of "
        f"{len(ranges)} joints, the narrowest {ranges[narrow, 0]:.4g} to {ranges[narrow, 1]:.4g}: lower smallest_move or "
        "clearance"
    )


def draw_waypoints(
    rng: np.random.Generator, count: int, ranges: Array, clearance: Array | float, smallest_move: Array | float
) -> Array:
    """Return as many random waypoints, one after the other [rad], shape (waypoint, joint); all else as of `draw_waypoint`."""
    points = np.zeros((count, len(ranges)))
    for k in range(count):
        points[k] = draw_waypoint(rng, ranges, points[max(k - 1, 0) : k], clearance, smallest_move)
    return points


@settings
class AbstractRandomMoves(AbstractTrajectory):
    """Moves between random waypoints."""

    moves: Annotated[Whole, Field(ge=1, le=100000)] = 30
    """Number of moves."""
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

    def drawn(self, rng: np.random.Generator, robot: Robot) -> Array:
        """Draw waypoints [rad], shape (moves + 1, joint); every joint moves in every move."""
        ranges = room(robot)
        width = np.diff(ranges, axis=1)[:, 0]
        clearance = np.minimum(0.2, width / 10) if self.clearance is None else self.clearance
        smallest = np.minimum(0.4, width / 4) if self.smallest_move is None else self.smallest_move
        return draw_waypoints(rng, self.moves + 1, ranges, clearance, smallest)


@settings
class RandomMoves(AbstractRandomMoves):
    """Fifth-order moves between random waypoints in random times."""

    durations: tuple[Positive, Positive] = (1.1, 1.55)
    """Shortest and longest time of a move [s]; those between are equally likely."""

    def __post_init__(self) -> None:
        if self.durations[0] > self.durations[1]:
            raise ScenarioError(f"durations = {list(self.durations)}: the shortest is above the longest")

    def plan(self, robot: Robot) -> PointToPoint:
        """Draw waypoints and times."""
        rng = np.random.default_rng(self.seed)
        points = self.drawn(rng, robot)
        velocity = per_joint(self.velocity, robot.n, "trajectory.velocity")
        fastest = (PEAK_VELOCITY * np.abs(np.diff(points, axis=0)) / velocity).max(axis=1)
        return at_rest(points, np.maximum(rng.uniform(*self.durations, self.moves), fastest), self.rest)


@settings
class RandomPace(AbstractTrajectory):
    """Fifth-order moves that fill a time: their number, times and room are random, as those of a class of motions.

    The paper specifies the class of its motion (fifth-order point-to-point moves in 40 s at 100 Hz), not the motion.
    """

    moves: tuple[Whole, Whole] = (16, 30)
    """Fewest and most moves."""
    shortest: Positive = 1.3
    """Least time of a move [s]."""
    moving: Positive = 40.0
    """Time of all moves [s]."""
    period: Positive = 0.01
    """Moves last whole multiples of this time [s]."""
    rest: NotNegative = 3.0
    """Time at rest at either end [s]."""
    clearance: NotNegative = 0.2
    """Least distance to the ends of the joints' ranges [rad]."""
    smallest_move: Positive = 0.1
    """Least distance of every joint in every move [rad]."""
    velocity: Positive = 7.0
    """Largest speed [rad/s]; a seed whose motion would be faster is refused."""
    seed: Seed = 0
    """The same seed gives the same motion."""

    def __post_init__(self) -> None:
        if not 1 <= self.moves[0] <= self.moves[1] or self.moves[1] * self.shortest > self.moving:
            raise ScenarioError(
                f"moves = {list(self.moves)}: at least 1, the fewest first, and all of {self.shortest:g} s in {self.moving:g} s"
            )

    def plan(self, robot: Robot) -> PointToPoint:
        """Draw number, times, room and waypoints."""
        rng = np.random.default_rng(self.seed)
        count = int(rng.integers(self.moves[0], self.moves[1] + 1))
        spare = round((self.moving - count * self.shortest) / self.period)
        edges = np.concatenate([[0], np.sort(rng.integers(0, spare + 1, count - 1)), [spare]])
        ranges = room(robot)
        middle, half = ranges.mean(axis=1), np.diff(ranges, axis=1)[:, 0] / 2 - self.clearance
        reach = half * rng.uniform(0.2, 1.0, robot.n)
        around = np.stack([middle - reach, middle + reach], axis=1) + (rng.uniform(-1, 1, robot.n) * (half - reach))[:, None]
        points = draw_waypoints(rng, count + 1, around, 0.0, self.smallest_move)
        found = at_rest(points, self.shortest + np.diff(edges) * self.period, self.rest)
        if (fastest := float(found.peak_velocity.max())) > self.velocity:
            raise ScenarioError(f"seed {self.seed} draws a motion of {fastest:.3g} rad/s, above velocity = {self.velocity:g}")
        return found


def room(robot: Robot) -> Array:
    """Ranges of random motion, shape (joint, 2): their ranges, or half a turn or metre to either side."""
    around = robot.model.qpos0[:, None] + np.where(robot.slides, 0.5, np.pi)[:, None] * [-1.0, 1.0]
    return np.where(np.isfinite(robot.ranges), robot.ranges, around)
