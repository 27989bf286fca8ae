"""The motion that a maximum-likelihood fit finds, with its uncertainty."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import scipy

from identify.arrays import Array
from identify.data.motion_log import MotionLog
from identify.errors import IdentificationError
from identify.estimators.likelihood.cells import hermite
from identify.estimators.likelihood.joint_fit import JointFit
from identify.estimators.likelihood.normal_equations import NormalEquations
from identify.rows.block_tridiagonal import Blocks, Cholesky

NODES = 8
"""Nodes of a block: larger ones make more work in each, smaller ones more blocks."""


class SmoothedMotion(NamedTuple):
    """A motion and its standard deviations, shape (time, joint)."""

    t: Array
    """Instants [s], shape (time,)."""

    q: Array
    qd: Array
    qdd: Array
    sigma_q: Array
    sigma_qd: Array
    sigma_qdd: Array


def smoothed_motion(fit: JointFit, log: int = 0, t: Array | None = None) -> SmoothedMotion:
    """Return the motion of a log as positions, torques and the robot's equation together say.

    Parameters
    ----------
    fit : JointFit
        A maximum-likelihood fit, such as `estimate.fits[()]`.
    log : int
        Which of its logs.
    t : Array, shape (time,), optional
        Instants [s]; by default those of the log's samples, as far as its torques go.

    Raises
    ------
    IdentificationError
        If an instant lies beyond the torques of the log.
    """
    cells, z = fit.logs[log], fit.motions[log]
    fs = cells.log.fs
    given = np.flatnonzero(cells.inside) / fs if t is None else np.asarray(t, dtype=np.float64)
    at = (given - cells.delay) * fs
    if len(at) and (at.min() < -1e-6 or at.max() > cells.count + 1e-6):
        last = cells.delay + cells.count / fs
        raise IdentificationError(f"instants must lie in {cells.delay:g} to {last:g} s, where torques are known")
    cell = np.clip(np.floor(at + 1e-9).astype(np.intp), 0, cells.count - 1)
    weights = hermite(at - cell, 1 / fs)
    ends = np.stack([z[cell, 0], z[cell, 1], z[cell + 1, 0], z[cell + 1, 1]])
    covariance = _covariance(fit, log)[cell]
    values = [np.einsum("kt,ktj->tj", w, ends) for w in weights]
    sigmas = [np.sqrt(np.einsum("kt,tjkm,mt->tj", w, covariance, w)) for w in weights]
    return SmoothedMotion(given, *values, *sigmas)


def smoothed_log(fit: JointFit, log: int = 0) -> MotionLog:
    """Return a log of the smoothed positions and their torques, with the delay of the fit, for other models or estimators."""
    cells, motion = fit.logs[log], smoothed_motion(fit, log)
    first = round(motion.t[0] * cells.log.fs)
    tau, torque = cells.log.tau[first : first + len(motion.q)], replace(cells.log.torque, delay=cells.delay)
    return MotionLog(cells.log.fs, motion.q, tau, torque, cells.log.conditions)


def _covariance(fit: JointFit, log: int) -> Array:
    """Return the covariance of (q0, qd0, q1, qd1) of every cell and joint, shape (cell, joint, 4, 4)."""
    cells, z = fit.logs[log], fit.motions[log]
    system = NormalEquations.of(cells, fit.basis, fit.X, z, fit.noise(log))
    inverse = _windows(Cholesky.of(_blocks(system.band, cells.log.n)).inverse_blocks(), cells.log.n)[: cells.count]
    V, _, L = system.solved()
    U, _ = scipy.linalg.lapack.dtbtrs(L, V, uplo="L", trans="T")
    of_X = U[:, : len(fit.unknowns)].reshape(len(z), 2, cells.log.n, -1)
    pairs = np.concatenate([of_X[:-1], of_X[1:]], axis=1).transpose(0, 2, 1, 3)
    return inverse + np.matmul(np.matmul(pairs, fit.covariance), np.swapaxes(pairs, -1, -2))


def _blocks(band: Array, n: int) -> Blocks:
    """Return the matrix of a lower band in blocks of some nodes, with ones where there are none."""
    size, b = band.shape[1], NODES * 2 * n
    count = -(-size // b)
    own, following = np.zeros((count, b, b)), np.zeros((count - 1, b, b))
    for below in range(len(band)):
        value = np.zeros(count * b)
        value[: size - below] = band[below, : size - below]
        column = np.arange(count * b)
        block, j = np.divmod(column, b)
        inside = j + below < b
        own[block[inside], j[inside] + below, j[inside]] = value[inside]
        own[block[inside], j[inside], j[inside] + below] = value[inside]
        beyond = ~inside & (block < count - 1)
        following[block[beyond], j[beyond], j[beyond] + below - b] = value[beyond]
    last = np.arange(size, count * b) % b
    own[-1, last, last] = 1.0
    return Blocks(own, following)


def _windows(inverse: Blocks, n: int) -> Array:
    """Return what the inverse has of both nodes of every cell, joint by joint, shape (cell, joint, 4, 4)."""
    count, b, _ = inverse.own.shape
    wide = np.concatenate([inverse.own, np.concatenate([inverse.next, np.zeros((1, b, b))])], axis=2)
    later = np.concatenate([inverse.own[1:], inverse.own[-1:]])
    found = np.zeros((count, NODES, n, 4, 4))
    for node in range(NODES):
        for j in range(n):
            index = 2 * n * node + np.array([j, n + j, 2 * n + j, 3 * n + j])
            for k in range(4):
                for m in range(k, 4):
                    row, column = index[k], index[m]
                    value = wide[:, row, column] if row < b else later[:, row - b, column - b]
                    found[:, node, j, k, m] = found[:, node, j, m, k] = value
    return found.reshape(count * NODES, n, 4, 4)
