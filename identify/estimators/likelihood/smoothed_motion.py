"""The motion that a maximum-likelihood fit finds, with its uncertainty."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import scipy

from idbench.identify.arrays import Array
from idbench.identify.data.motion_log import MotionLog
from idbench.identify.errors import IdentificationError
from idbench.identify.estimators.likelihood.cells import hermite
from idbench.identify.estimators.likelihood.joint_fit import JointFit
from idbench.identify.estimators.likelihood.normal_equations import NormalEquations
from idbench.identify.noise.band_matrix import Band, Cholesky


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
    V, _, L = system.solved()
    inverse = _windows(Cholesky(np.ascontiguousarray(L.T)).inverse(), cells.log.n)
    U, _ = scipy.linalg.lapack.dtbtrs(L, V, uplo="L", trans="T")
    of_X = U[:, : len(fit.unknowns)].reshape(len(z), 2, cells.log.n, -1)
    pairs = np.concatenate([of_X[:-1], of_X[1:]], axis=1).transpose(0, 2, 1, 3)
    return inverse + np.matmul(np.matmul(pairs, fit.covariance), np.swapaxes(pairs, -1, -2))


def _windows(inverse: Band, n: int) -> Array:
    """Return what the inverse has of both nodes of every cell, joint by joint, shape (cell, joint, 4, 4)."""
    cells = len(inverse.lower) // (2 * n) - 1
    found, first = np.zeros((cells, n, 4, 4)), 2 * n * np.arange(cells)[:, None] + np.arange(n)
    for k in range(4):
        for m in range(k, 4):
            found[..., k, m] = found[..., m, k] = inverse.lower[first + n * k, n * (m - k)]
    return found
