"""Time-optimal moves with limited jerk, by ruckig."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Self

import numpy as np
from ruckig import InputParameter, Result, Ruckig, RuckigError, Trajectory

from idbench.sim.errors import ScenarioError
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.settings import EachPositive, NotNegative, Positions, per_joint, settings
from idbench.sim.trajectories.quintic import AbstractRandomMoves
from idbench.sim.trajectories.trajectory import AbstractMotion, AbstractTrajectory, Reference, require_in_range


@dataclass(frozen=True, eq=False)
class JerkLimited(AbstractMotion):
    """Moves of piecewise constant jerk."""

    start: Array
    """Time at which each piece begins [s]; the first at or before 0, shape (joint, piece)."""
    states: Array
    """Position, velocity, acceleration and jerk at that time, shape (joint, piece, 4)."""
    end: float
    """Duration [s]."""

    @classmethod
    def between(cls, points: Array, limits: Array, rest: float, shortest: float = 0.0) -> Self:
        """Return the fastest moves from each of `points`, shape (w, joint), to the next, at rest in all of them.

        `limits` are those of velocity, acceleration and jerk, shape (3, joint); `rest` [s] is spent at both ends, and every
        move takes `shortest` [s] or more.

        Raises
        ------
        ScenarioError
            If ruckig finds no such moves.
        """
        n, clock = points.shape[1], rest
        start = [np.zeros((n, 1))]
        states = [_standing(points[0])]
        for before, after in pairwise(points):
            move = _fastest(before, after, limits, shortest)
            pieces = [_pieces(profile) for profile in move.profiles[0]]
            start.append(clock + np.array([t for t, _ in pieces]))
            states.append(np.array([x for _, x in pieces]))
            clock += move.duration
            start.append(np.full((n, 1), clock))
            states.append(_standing(after))
        return cls(np.concatenate(start, axis=1), np.concatenate(states, axis=1), clock + rest)

    @property
    def duration(self) -> float:
        """Time from the first to the last instant, pauses included [s]."""
        return self.end

    def at(self, t: Array, fs: float) -> Reference:
        """Return the motion at the times `t` [s], shape (time,)."""
        q, qd, qdd = np.empty((3, len(t), len(self.start)))
        for j, (start, states) in enumerate(zip(self.start, self.states, strict=True)):
            piece = np.clip(np.searchsorted(start, t, side="right") - 1, 0, None)
            dt, (p, v, a, jerk) = np.maximum(t - start[piece], 0.0), states[piece].T
            q[:, j] = p + dt * (v + dt * (a / 2 + dt * jerk / 6))
            qd[:, j] = v + dt * (a + dt * jerk / 2)
            qdd[:, j] = a + dt * jerk
        return Reference(fs, q, qd, qdd)


@settings
class TimeOptimal(AbstractTrajectory):
    """Time-optimal moves under limits of velocity, acceleration and jerk (ruckig), at rest in every waypoint."""

    waypoints: Positions = ((0.0, 0.0), (1.0, -1.0))
    """Positions at rest, joint by joint [rad]; at least two."""
    velocity: EachPositive = (7.0,)
    """Largest speed [rad/s], of all joints or of each."""
    acceleration: EachPositive = (18.0,)
    """Largest acceleration [rad/s^2], of all joints or of each."""
    jerk: EachPositive = (300.0,)
    """Largest jerk [rad/s^3], of all joints or of each."""
    rest: NotNegative = 3.0
    """Time at rest before the first and after the last move [s]."""

    def __post_init__(self) -> None:
        if len(self.waypoints) < 2 or len({len(point) for point in self.waypoints}) != 1 or not self.waypoints[0]:
            raise ScenarioError("waypoints must be at least 2, all with the same number of joints")

    def plan(self, robot: Robot) -> JerkLimited:
        """Return ruckig's moves."""
        points = np.array(self.waypoints)
        return JerkLimited.between(points, _limits(self, points.shape[1]), self.rest)


@settings
class RandomTimeOptimal(AbstractRandomMoves):
    """Moves between random waypoints, as fast as limits of velocity, acceleration and jerk allow (ruckig)."""

    duration: NotNegative = 0.0
    """Least time of a move [s]; a move that the limits make slower takes longer."""
    acceleration: EachPositive = (18.0,)
    """Largest acceleration [rad/s^2], of all joints or of each."""
    jerk: EachPositive = (300.0,)
    """Largest jerk [rad/s^3], of all joints or of each."""

    def plan(self, robot: Robot) -> JerkLimited:
        """Draw waypoints; return ruckig's moves."""
        points = self.drawn(np.random.default_rng(self.seed), robot)
        return JerkLimited.between(points, _limits(self, robot.n), self.rest, self.duration)


def _limits(asked: TimeOptimal | RandomTimeOptimal, n: int) -> Array:
    names = ("velocity", "acceleration", "jerk")
    return np.array([per_joint(getattr(asked, name), n, f"trajectory.{name}") for name in names])


def _fastest(before: Array, after: Array, limits: Array, shortest: float) -> Trajectory:
    n = len(before)
    wanted, move = InputParameter(n), Trajectory(n)
    wanted.current_position, wanted.target_position = before.tolist(), after.tolist()
    wanted.minimum_duration = shortest or None
    wanted.max_velocity, wanted.max_acceleration, wanted.max_jerk = limits.tolist()
    try:
        result = Ruckig(n).calculate(wanted, move)
    except (RuckigError, ValueError) as error:  # of numbers so small or large that it has no name for what is wrong
        raise ScenarioError(f"ruckig refuses the move to {after.tolist()}: {' '.join(str(error).split())}") from error
    if result not in (Result.Working, Result.Finished):
        raise ScenarioError(f"ruckig finds no move to {after.tolist()}: {result.name}")
    return move


def _pieces(profile: object) -> tuple[Array, Array]:
    """Return the beginnings [s] and states of the seven pieces of one joint's move."""
    t, a, v, p, jerk = (np.array(getattr(profile, name), dtype=np.float64) for name in ("t", "a", "v", "p", "j"))
    return np.concatenate([[0.0], t.cumsum()[:-1]]), np.stack([p[:7], v[:7], a[:7], jerk], axis=-1)


def _standing(point: Array) -> Array:
    states = np.zeros((len(point), 1, 4))
    states[:, 0, 0] = point
    return states


VELOCITY = 1.0  # Largest speed of a gentle move [rad/s]
ACCELERATION = 5.0  # Largest acceleration of a gentle move [rad/s^2]
JERK = 50.0  # Largest jerk of a gentle move [rad/s^3]
REST = 0.2  # Time at rest before and after it [s]


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
