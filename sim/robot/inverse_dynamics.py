"""Torques that make a robot move along given states: MuJoCo's inverse dynamics, and a friction law."""

from collections.abc import Iterator, Mapping

import numpy as np
import numpy.typing as npt
from mujoco import mjtStage
from mujoco.batch import Batch

from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.varied import vary_fields

BLOCK = 8192  # States evaluated together: bounds the memory of long trajectories


class InverseDynamics:
    """M(q) qdd + bias - passive forces [N m] of many states at once, all from MuJoCo, without `frictionloss`.

    This is `mj_inverse` without its constraint forces. With `frictionloss`, `mj_inverse` takes the sign of the friction
    from qd plus a share of qdd, so that joints that brake get the wrong one; damping, a passive force, is right. Every call has
    `count` states; `vary` has fields of MuJoCo's model with a value for each, shape (state, ...).
    """

    def __init__(self, robot: Robot, count: int, vary: Mapping[str, npt.ArrayLike] | None = None) -> None:
        self._states = Batch(robot.model, count)
        vary_fields(self._states, vary or {})
        names = ("qpos", "qvel", "M", "qfrc_bias", "qfrc_passive")
        self._q, self._qd, self._packed, self._bias, self._passive = (self._states.bind(name) for name in names)
        self._M = np.zeros((count, robot.n, robot.n))
        self._place = np.repeat(np.arange(robot.n), robot.model.M_rownnz), robot.model.M_colind

    def __call__(self, q: Array, qd: Array, qdd: Array) -> Array:
        """Return the torques at the states `q` [rad], `qd` [rad/s], `qdd` [rad/s^2], shape (state, joint)."""
        self._q[:], self._qd[:] = q, qd
        self._states.forward(stage=mjtStage.mjSTAGE_VEL.value)
        row, column = self._place
        self._M[:, row, column] = self._packed
        self._M[:, column, row] = self._packed
        # Sums along an axis of each state: the bits do not depend on how many states there are.
        return (self._M * qdd[:, None, :]).sum(axis=-1) + self._bias - self._passive

    @property
    def mass_matrix(self) -> Array:
        """M at the states of the last call [kg m^2], shape (state, joint, joint)."""
        return self._M

    def inertia(self, q: Array) -> Array:
        """Diagonal of M at the positions `q` [rad], shape (state, joint) [kg m^2]."""
        still = np.zeros_like(q)
        self(q, still, still)
        return np.diagonal(self._M, axis1=1, axis2=2).copy()


def inverse_dynamics(robot: Robot, q: Array, qd: Array, qdd: Array) -> Array:
    """Return the torques [N m] along a motion, as `InverseDynamics`; all arrays have the shape (time, joint)."""
    return np.concatenate([tau for _, tau in _blocks(robot, q, qd, qdd)])


def mass_matrices(robot: Robot, q: Array, qd: Array, qdd: Array) -> tuple[Array, Array]:
    """Mass matrices along a motion [kg m^2], shape (time, joint, joint), and its torques, shape (time, joint)."""
    M, tau = zip(*_blocks(robot, q, qd, qdd), strict=True)
    return np.concatenate(M), np.concatenate(tau)


def _blocks(robot: Robot, q: Array, qd: Array, qdd: Array) -> Iterator[tuple[Array, Array]]:
    """Yield mass matrices and torques of so many states at a time."""
    for b in (slice(i, i + BLOCK) for i in range(0, len(q), BLOCK)):
        dynamics = InverseDynamics(robot, len(q[b]))
        tau = dynamics(q[b], qd[b], qdd[b])
        yield dynamics.mass_matrix, tau


def coulomb_torque(robot: Robot, qd: Array) -> Array:
    """Return Fs sign(qd) [N m], shape (time, joint), with Fs the `frictionloss` of the model's joints."""
    return robot.model.dof_frictionloss * np.sign(qd)
