"""What several files of tests make: noisy logs, robots with their base parameters, columns as matrices and their identities."""

from dataclasses import replace
from typing import NamedTuple

import mujoco
import numpy as np

from idbench.identify import MODELS, BaseParameters, KinematicTree, MotionLog, State, tree_basis
from idbench.identify.servo import JointLoad
from idbench.sim.encoders import IncrementalEncoder
from idbench.sim.engine.simulation import simulate
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.tree import kinematic_tree, standard_parameters
from idbench.sim.scenario.scenario_file import load
from idbench.sim.trajectories import RandomMoves

EPS = 1e-30

SOLVED = [name for name in MODELS.builtin if name != "explicit+power"]  # By GLS, which refuses rows that repeat torques


class Arm(NamedTuple):
    """A robot, its tree, how its parameters are grouped, and their true values."""

    robot: Robot
    tree: KinematicTree
    grouping: BaseParameters
    X: np.ndarray


def arm(name):
    robot = Robot.load(name)
    tree, truth = kinematic_tree(robot), standard_parameters(robot)
    grouping = BaseParameters.of(tree, tree_basis(tree))
    return Arm(robot, tree, grouping, np.array([truth[name] for name in grouping.standard.names]))


def noisy(log, position, torque, runs=(), rng=5):
    """Return a log, or runs of it, with white noise of its positions [rad] and torques [N m]."""
    rng, shape = np.random.default_rng(rng), (*runs, *log.q.shape)
    q = log.q + position * rng.standard_normal(shape) if np.any(position) else np.broadcast_to(log.q, shape)
    return MotionLog(log.fs, q, log.tau + torque * rng.standard_normal(shape), log.torque)


MOVES = RandomMoves(moves=12, durations=(1.3, 1.3), rest=0.7, seed=1)


def closed(bits, runs=1, **parts):
    """Return a scenario with an encoder, and the log of its runs."""
    scenario = replace(load("ideal"), **{"trajectory": MOVES, "encoder": IncrementalEncoder(lines=2 ** (bits - 2)), **parts})
    log = simulate(scenario, range(runs)).log
    return scenario, log if runs > 1 else log.run((0,))


def dense(C):
    """Return a banded covariance of one run as a matrix."""
    lags, count, kinds = C.bands.shape[:3]
    whole = np.zeros((count, kinds, count, kinds))
    for lag in range(lags):
        for i in range(count - lag):
            whole[i, :, i + lag], whole[i + lag, :, i] = C.bands[lag, i], C.bands[lag, i].T
    return whole.reshape(count * kinds, -1)


def forward(robot, q):
    """Return MuJoCo's data of a robot at rest in some place."""
    data = mujoco.MjData(robot.model)
    data.qpos[:] = q
    mujoco.mj_forward(robot.model, data)
    return data


def at(q, qd, qdd):
    return State(q, qd, lambda _: qdd)


def matrix(columns, rows, names, times):
    """Return columns of a basis, or of a block, as a dense array, shape (time, row, parameter)."""
    made = np.zeros((times, rows, len(names)))
    for (row, of), signal in columns.items():
        made[:, row, of if isinstance(of, int) else names.index(of.name)] = signal
    return made


def rate(columns, q, qd, qdd):
    """Return d/dt of columns along a motion, by a complex step: exact to rounding, with no difference taken."""
    ahead = at(q + 1j * EPS * qd, qd + 1j * EPS * qdd, None)
    return {address: np.imag(signal) / EPS for address, signal in columns(ahead).items()}


def defects(block, names, q, qd, qdd):
    """Return by how much explicit = s momentum + remainder and qd' explicit = s energy + dissipation fail."""
    (n, times), state = q.shape, at(q, qd, qdd)
    D = matrix(block.explicit(state), n, names, times)
    implicit = matrix(rate(block.momentum, q, qd, qdd), n, names, times) + matrix(block.remainder(state), n, names, times)
    power = matrix(rate(block.energy, q, qd, qdd), 1, names, times) + matrix(block.dissipation(state), 1, names, times)
    return np.abs(D - implicit).max(), np.abs(np.einsum("jk,kjp->kp", qd, D) - power[:, 0]).max()


def pendulum(mass, length):
    """Load of a point mass [kg] at a distance [m] from a horizontal axis; q = 0 hangs down."""
    none = np.array(0.0)
    return JointLoad(np.array(mass * length**2), np.array(mass * 9.81 * length), none, none)
