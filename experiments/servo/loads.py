"""Logs of servos as runs of each joint, with what the robot's links need of it."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from idbench.identify import Array
from idbench.identify.files.servo_log import ServoColumns
from idbench.identify.servo import JointLoad
from idbench.identify.servo.run import without_spikes
from idbench.identify.servo.smooth import corrected, smoothed
from idbench.sim.robot.inverse_dynamics import InverseDynamics, inverse_dynamics
from idbench.sim.robot.robot import Robot


class Moving(NamedTuple):
    """How a joint moves by its fit: positions of the log [rad], shape (time,), and what makes angles of the file of them."""

    q: Array
    offset: float


def loads(robot: Robot, columns: ServoColumns, moving: Mapping[int, Moving] | None = None) -> list[JointLoad]:
    """Return the load of each joint of a robot while the others move as they were measured, or as their servos do.

    Gravity follows the joint's own angle exactly; what accelerations and velocities of the others need is that of the measured
    motion, smoothed, or of the simulated one (see `corrected`), by the number of the joint.
    """
    t, n = columns.t, robot.n
    measured = q = np.stack([without_spikes(t, x) for x in columns.q.T], axis=1)
    if n == 1:
        qd = qdd = np.zeros_like(q)
    else:
        q, qd, qdd = smoothed(t, q)
        for j, of in (moving or {}).items():
            q[:, j], qd[:, j], qdd[:, j] = corrected(t, of.q, measured[:, j])
            q[:, j] += of.offset
    dynamics = InverseDynamics(robot, len(q))
    still = np.zeros_like(q)
    whole = dynamics(q, qd, qdd).copy()
    inertia = dynamics.inertia().copy()
    found = []
    for j in range(n):
        at = [inverse_dynamics(robot, _moved(q, j, angle), still, still)[:, j] for angle in (0.0, np.pi / 2, np.pi)]
        constant = (at[0] + at[2]) / 2
        cosine, sine = at[0] - constant, at[1] - constant
        if robot.slides[j]:
            constant, cosine, sine = at[0], 0 * constant, 0 * constant
        gravity = sine * np.sin(q[:, j]) + cosine * np.cos(q[:, j]) + constant
        rest = whole[:, j] - inertia[:, j] * qdd[:, j] - gravity + constant
        found.append(JointLoad(*(_constant(x) for x in (inertia[:, j], sine, cosine, rest))))
    return found


def _moved(q: Array, j: int, angle: float) -> Array:
    moved = q.copy()
    moved[:, j] = angle
    return moved


def _constant(x: Array) -> Array:
    """Return one number where all are the same but for rounding."""
    size = float(np.abs(x).max())
    return np.array(x[0] if size > 0 else 0.0) if np.ptp(x) <= 1e-9 * size or size == 0 else x
