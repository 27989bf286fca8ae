"""Simulations that cannot go on: which they are, and why."""

from collections.abc import Mapping, Sequence

import numpy as np

from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.trajectories import Reference

TURN = 2 * np.pi  # How far [rad] a hinge without range may be from where its motion goes: one turn
FAR = 1.0  # How far [m] a slide without range may be from where its motion goes, or as far as the motion goes, if that is more
FAST = 10.0  # Speed, as a multiple of the largest that the motion asks of a joint, that no loop at work reaches
MIN_SPEED = 1.0  # Speed [rad/s, m/s] that counts as the motion's where it asks for less: joints at rest are pushed by others

ADVICE = (
    "the loop is unstable or too weak; lower controller.bandwidth or timing.delay, raise fs, ask less of the drive, or, if the "
    "robot's file has placeholders for friction, state [friction]"
)


class Bounds:
    """Where a loop at work keeps its joints, and how fast, about the motion planned for all `nsim` simulations or for each."""

    def __init__(self, robot: Robot, planned: Reference, nsim: int) -> None:
        low, high = planned.q.min(axis=0), planned.q.max(axis=0)
        room = np.where(robot.slides, np.maximum(FAR, high - low), TURN)
        self._joints, self._unit = robot.joints, np.where(robot.slides, "m", "rad")
        self._limited = np.asarray(np.isfinite(robot.ranges).all(axis=1))
        ends = (
            np.where(self._limited, np.minimum(robot.ranges[:, 0], low), low - room),
            np.where(self._limited, np.maximum(robot.ranges[:, 1], high), high + room),
        )
        low, high = (np.broadcast_to(end, (nsim, robot.n)) for end in ends)
        self._middle, self._half = (low + high) / 2, (high - low) / 2
        self._fastest = FAST * np.maximum(np.abs(planned.qd).max(axis=0), MIN_SPEED)

    def broken(self, q: Array, qd: Array) -> dict[int, str]:
        """Return the simulations whose state, shape (nsim, joint), is none of a loop at work, and what their joint does."""
        inside, slow = np.abs(q - self._middle) <= self._half, np.abs(qd) <= self._fastest  # both False for NaN
        if inside.all() and slow.all():
            return {}
        found = dict[int, str]()
        for sim, j in np.argwhere(~(inside & slow)).tolist():
            why = self._why(j, float(q[sim, j]), float(qd[sim, j]), bool(inside[sim, j]))
            found.setdefault(sim, f"joint {self._joints[j]} {why}")
        return found

    def _why(self, j: int, q: float, qd: float, inside: bool) -> str:
        if not np.isfinite([q, qd]).all():
            return "diverges"
        if inside:
            return f"runs away at {qd:.3g} {self._unit[j]}/s"
        return "leaves its range" if self._limited[j] else f"runs away to {q:.3g} {self._unit[j]}"


class Failures:
    """The simulations of a run that have failed, each by itself."""

    def __init__(self, robot: Robot, planned: Reference, seeds: Sequence[int]) -> None:
        self.reasons: dict[int, str] = {}
        self._bounds = Bounds(robot, planned, len(seeds))
        self._fs = planned.fs
        self._seeds = seeds

    def look(self, sample: float, q: Array, qd: Array) -> None:
        """Count simulations as failed whose state, shape (nsim, joint), is none of a loop at work.

        `sample` says when that is, in sampling periods after the start.
        """
        for sim, what in self._bounds.broken(q, qd).items():
            self.add(sim, f"{what} {sample / self._fs:.3g} s after the start", ADVICE)

    def finite(self, torques: Mapping[str, Array | float]) -> None:
        """Count simulations as failed in which a part of the bench gives a torque, shape (..., nsim, joint), of no size."""
        for part, torque in torques.items():
            good = np.broadcast_to(np.isfinite(torque), (1, len(self._seeds), 1) if np.ndim(torque) == 0 else np.shape(torque))
            for sim in np.unique(np.argwhere(~good)[:, -2]).tolist():
                self.add(sim, f"{part} gives no finite torque")

    def add(self, sim: int, what: str, advice: str = "") -> None:
        """Let a simulation count as failed, for the first reason that is found."""
        self.reasons.setdefault(sim, f"{what} (seed {self._seeds[sim]})" + (f": {advice}" if advice else ""))
