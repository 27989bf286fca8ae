"""Torques that make a robot move along given states: MuJoCo's inverse dynamics, and a friction law."""

import numpy as np
from mujoco import mjtStage
from mujoco.batch import Batch

from sim.robot import Array, Robot

BLOCK = 8192
"""States evaluated together: bounds the memory of long trajectories."""


def inverse_dynamics(robot: Robot, q: Array, qd: Array, qdd: Array) -> Array:
    """Return M(q) qdd + bias - passive forces [N m], shape (time, joint), all from MuJoCo, without `frictionloss`.

    This is `mj_inverse` without its constraint forces. With `frictionloss`, `mj_inverse` takes the sign of the friction
    from qd plus a share of qdd, so that joints that brake get the wrong one; damping, a passive force, is right.

    Parameters
    ----------
    robot : Robot
        The arm.
    q, qd, qdd : Array, shape (time, joint)
        [rad], [rad/s], [rad/s^2].
    """
    blocks = range(0, len(q), BLOCK)
    return np.concatenate([_block(robot, *(x[i : i + BLOCK] for x in (q, qd, qdd))) for i in blocks])


def _block(robot: Robot, q: Array, qd: Array, qdd: Array) -> Array:
    states = Batch(robot.model, len(q))
    M, bias, passive = states.bind("M"), states.bind("qfrc_bias"), states.bind("qfrc_passive")
    states.bind("qpos")[:] = q
    states.bind("qvel")[:] = qd
    states.forward(stage=mjtStage.mjSTAGE_VEL.value)
    dense = np.zeros((len(q), robot.n, robot.n))
    row, column = np.repeat(np.arange(robot.n), robot.model.M_rownnz), robot.model.M_colind
    dense[:, row, column] = M
    dense[:, column, row] = M
    return np.matmul(dense, qdd[..., None])[..., 0] + bias - passive


def coulomb_torque(robot: Robot, qd: Array) -> Array:
    """Return Fs sign(qd) [N m], shape (time, joint), with Fs the `frictionloss` of the model's joints."""
    return robot.model.dof_frictionloss * np.sign(qd)
