"""Simulations that cannot go on, and why."""

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
        fastest = FAST * np.maximum(np.abs(planned.qd).max(axis=0), MIN_SPEED)
        self.box: tuple[Array, Array, Array] = (low + high) / 2, (high - low) / 2, np.broadcast_to(fastest, (nsim, robot.n))
        """Middle and half of the range of positions, and largest speed, shape (nsim, joint)."""

    def broken(self, sim: int, q: Array, qd: Array) -> str:
        """What a joint does in a simulation whose state, shape (joint,), is none of a loop at work; empty if it is one."""
        middle, half, fastest = (x[sim] for x in self.box)
        inside, slow = np.abs(q - middle) <= half, np.abs(qd) <= fastest  # both False for NaN
        for j in np.flatnonzero(~(inside & slow)).tolist():
            return f"joint {self._joints[j]} {self._why(j, float(q[j]), float(qd[j]), bool(inside[j]))}"
        return ""

    def all_broken(self, q: Array, qd: Array) -> dict[int, str]:
        """Broken simulations by their number, and what their joint does; states of all, shape (nsim, joint)."""
        middle, half, fastest = self.box
        good = (np.abs(q - middle) <= half) & (np.abs(qd) <= fastest)  # False for NaN
        return {sim: self.broken(sim, q[sim], qd[sim]) for sim in np.flatnonzero(~good.all(axis=1)).tolist()}

    def _why(self, j: int, q: float, qd: float, inside: bool) -> str:
        if not np.isfinite([q, qd]).all():
            return "diverges"
        if inside:
            return f"runs away at {qd:.3g} {self._unit[j]}/s"
        return "leaves its range" if self._limited[j] else f"runs away to {q:.3g} {self._unit[j]}"
