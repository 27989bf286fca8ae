"""What the links of a robot need of each joint, while the others move as they were measured, or as their servos do."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from idbench.identify import Array
from idbench.identify.files.servo_log import ServoColumns
from idbench.identify.servo import JointLoad
from idbench.identify.servo.rows import corrected, smoothed
from idbench.identify.servo.run import without_spikes
from idbench.sim.robot.inverse_dynamics import BLOCK, InverseDynamics, inverse_dynamics
from idbench.sim.robot.robot import Robot


class Moving(NamedTuple):
    """How a joint moves by its fit: steps [s], positions of the log [rad], and what makes angles of the file of them.

    Of a simulation beside: its armature, what its integrator adds to that where it takes damping late, and how much earlier
    than positions its velocities are [s] (see `TimeSteps`).
    """

    t: Array
    q: Array
    offset: float
    armature: float = 0.0
    taken: float = 0.0
    early: float = 0.0


def loads(robot: Robot, columns: ServoColumns, moving: Mapping[int, Moving] | None = None) -> list[JointLoad]:
    """Return the load of each joint of a robot while the others move as they were measured, or as their servos do.

    Gravity follows the joint's own angle exactly; what accelerations and velocities of the others need is that of the measured
    motion, smoothed, or of the simulated one (see `corrected`), by the number of the joint, at each step of its simulation: a
    command that jumps makes accelerations that are over before the next sample.
    """
    t, n = columns.t, robot.n
    measured = np.stack([without_spikes(t, x) for x in columns.q.T], axis=1)
    if n == 1:
        still = np.zeros((1, 1))
        return [JointLoad(_inertias(robot, still)[0][0, 0, 0], *(x[0, 0] for x in _gravity(robot, still)))]
    fine = min((of.t for of in (moving or {}).values()), key=lambda x: x[1] - x[0], default=t)
    q, qd, qdd = smoothed(t, measured)
    slow = [np.stack([np.interp(fine, t, x) for x in y.T], axis=1) for y in (q, qd, qdd)]
    for j, of in (moving or {}).items():
        for y, x in zip(slow, corrected(fine, np.interp(fine, of.t, of.q), t, measured[:, j]), strict=True):
            y[:, j] = x
        slow[0][:, j] += of.offset
        slow[1][:, j] -= of.early * slow[2][:, j]
        q[:, j] += of.offset
    q_fine, qd_fine, qdd_fine = slow
    M, whole = _inertias(robot, q_fine, qd_fine, qdd_fine)
    inertia = np.diagonal(M, axis1=1, axis2=2)
    lightness, shaking = _seen_by_friction(M, qdd_fine, moving or {})
    sines, cosines, _ = _gravity(robot, q)
    found = []
    for j in range(n):
        sine, cosine = (np.interp(fine, t, x[:, j]) for x in (sines, cosines))
        gravity = sine * np.sin(q_fine[:, j]) + cosine * np.cos(q_fine[:, j])
        rest = whole[:, j] - inertia[:, j] * qdd_fine[:, j] - gravity
        parts = [_constant(x) for x in (inertia[:, j], sine, cosine, rest, lightness[:, j], shaking[:, j])]
        found.append(JointLoad(parts[0], parts[1], parts[2], parts[3], parts[4], parts[5], fine))
    return found


def _seen_by_friction(M: Array, qdd: Array, moving: Mapping[int, Moving]) -> tuple[Array, Array]:
    """Return diagonals of the inverse mass matrix, and how others' damping shakes each joint, shape (time, joint).

    MuJoCo finds dry friction by accelerations without what its integrator then takes late of the damping, h D: those are
    (1 + M^-1 h D) a. Zeros where nothing is taken late.
    """
    armature, taken = np.zeros((2, M.shape[-1]))
    for j, of in moving.items():
        armature[j], taken[j] = of.armature, of.taken
    if not taken.any():
        return np.zeros_like(qdd), np.zeros_like(qdd)
    inverse = np.linalg.inv(M + np.diag(armature))
    diagonal = np.diagonal(inverse, axis1=1, axis2=2)
    pushed = taken * qdd
    return diagonal, np.einsum("tjk,tk->tj", inverse, pushed) - diagonal * pushed


def _inertias(robot: Robot, q: Array, qd: Array | None = None, qdd: Array | None = None) -> tuple[Array, Array]:
    """Return M, shape (time, joint, joint), and the torques of a motion, shape (time, joint)."""
    qd, qdd = (np.zeros_like(q) if x is None else x for x in (qd, qdd))
    found = []
    for some in (slice(i, i + BLOCK) for i in range(0, len(q), BLOCK)):
        dynamics = InverseDynamics(robot, len(q[some]))
        whole = dynamics(q[some], qd[some], qdd[some]).copy()
        found.append((dynamics.mass_matrix.copy(), whole))
    M, torques = (np.concatenate(x) for x in zip(*found, strict=True))
    return M, torques


def _gravity(robot: Robot, q: Array) -> tuple[Array, Array, Array]:
    """Return gravity along sine and cosine of each joint's angle while the others stand at q, and of slides, each (time, n).

    A turn by delta from where a joint is turns the weight that it carries: c cos(delta) + s sin(delta), c being the torque
    there, and s that after a quarter of a turn.
    """
    still = np.zeros_like(q)
    there = inverse_dynamics(robot, q, still, still)
    quarter = np.stack([inverse_dynamics(robot, _moved(q, j), still, still)[:, j] for j in range(robot.n)], axis=1)
    sine, cosine = there * np.sin(q) + quarter * np.cos(q), there * np.cos(q) - quarter * np.sin(q)
    slides = np.asarray(robot.slides, dtype=bool)
    return np.where(slides, 0.0, sine), np.where(slides, 0.0, cosine), np.where(slides, there, 0.0)


def _moved(q: Array, j: int) -> Array:
    moved = q.copy()
    moved[:, j] += np.pi / 2
    return moved


def _constant(x: Array) -> Array:
    """Return one number where all are the same but for rounding."""
    size = float(np.abs(x).max())
    return np.array(x[0] if size > 0 else 0.0) if np.ptp(x) <= 1e-9 * size or size == 0 else x
