"""The least error that any estimator can have: the Cramer-Rao bound."""

import numpy as np

from identify.arrays import Array
from identify.basis.basis import Basis
from identify.estimators.likelihood.cells import GAUSS, hermite
from identify.estimators.likelihood.joint_fit import MASK, UNKNOWN
from identify.noise.linearization import friction_jumps, observation, slopes
from identify.noise.propagation import NoiseLevels

TERMS = 8
"""Terms of the exponential series: slopes times a period are well below 1."""


def cramer_rao(basis: Basis, X: Array, q: Array, qd: Array, fs: float, noise: NoiseLevels) -> Array:
    """Return the covariance that no unbiased estimate of X from a log of this motion can go below, shape (..., p, p).

    The log has the torques, held for a period each, with white noise, and the positions at the beginning of each, with white
    noise. A Kalman filter of the motion's small errors gives the innovations e_k, their covariances S_k, and how they move with
    the parameters, E_k = de_k / dX: the Fisher information is the sum of E_k' S_k^-1 E_k (L. Ljung, "System Identification:
    Theory for the User", 2nd ed., 1999, section 7.4). The motion's start is not known, nor is the friction of a joint that
    stands or turns.

    Parameters
    ----------
    basis : Basis
        The robot.
    X : Array, shape (p,)
        Its true parameters.
    q, qd : Array, shape (..., time, joint)
        True positions [rad] and velocities [rad/s] at the samples.
    fs : float
        Sampling frequency [Hz].
    noise : NoiseLevels
        Standard deviations, shape (joint,) each.
    """
    A, B, W = _steps(basis, X, q, qd, 1 / fs)
    unknown = UNKNOWN * friction_jumps(basis, X, np.reshape(q, (-1, basis.n))[0])
    weight = MASK.weight(np.moveaxis((qd[..., 1:, :] + qd[..., :-1, :]) / 2, -1, -2), fs)
    variance = np.moveaxis((noise.torque[:, None] + (1 - weight) * unknown[:, None]) ** 2, -1, -2)
    n, p, runs = basis.n, len(X), q.shape[:-2]
    P = np.broadcast_to(np.diag([1.0] * n + [100.0] * n), (*runs, 2 * n, 2 * n)).copy()
    slope, information = np.zeros((*runs, 2 * n, p)), np.zeros((*runs, p, p))
    R = np.diag(noise.position**2)
    for k in range(A.shape[-3] + 1):
        S = P[..., :n, :n] + R
        E = slope[..., :n, :]
        inverse = np.linalg.inv(S)
        information += np.matmul(np.swapaxes(E, -1, -2), np.matmul(inverse, E))
        if k == A.shape[-3]:
            break
        gain = np.matmul(P[..., :, :n], inverse)
        kept = np.eye(2 * n) - np.concatenate([gain, np.zeros_like(gain)], axis=-1)
        P = np.matmul(np.matmul(kept, P), np.swapaxes(kept, -1, -2)) + np.matmul(np.matmul(gain, R), np.swapaxes(gain, -1, -2))
        step, push = A[..., k, :, :], B[..., k, :, :]
        P = np.matmul(np.matmul(step, P), np.swapaxes(step, -1, -2))
        P += np.matmul(push * variance[..., k, None, :], np.swapaxes(push, -1, -2))
        slope = np.matmul(step, np.matmul(kept, slope)) - np.matmul(push, W[..., k, :, :])
    return np.linalg.pinv(information, hermitian=True)


def _steps(basis: Basis, X: Array, q: Array, qd: Array, T: float) -> tuple[Array, Array, Array]:
    """Return how errors of (q, qd) move over every period: A of themselves, B of a torque, and W of the parameters."""
    ends = np.stack([q[..., :-1, :], qd[..., :-1, :], q[..., 1:, :], qd[..., 1:, :]])
    middle, first, second = ([np.moveaxis(np.tensordot(w, ends, axes=1), -1, -2) for w in hermite(s, T)] for s in (0.5, *GAUSS))
    M, D, K = (np.moveaxis(x, -1, -3) for x in slopes(basis, X, middle[0], middle[1], middle[2], middle[1]))
    W = (observation(basis, *first) + observation(basis, *second)) / 2
    n, inverse = basis.n, np.linalg.inv(M)
    F = np.zeros((*M.shape[:-2], 2 * n, 2 * n))
    F[..., :n, n:] = np.eye(n)
    F[..., n:, :n], F[..., n:, n:] = -np.matmul(inverse, K), -np.matmul(inverse, D)
    push = np.concatenate([np.zeros_like(inverse), inverse], axis=-2)
    term, A, integral = np.broadcast_to(np.eye(2 * n), F.shape), np.zeros_like(F), np.zeros_like(F)
    for i in range(1, TERMS + 1):
        A, integral = A + term, integral + term * (T / i)
        term = np.matmul(F, term) * (T / i)
    return A, np.matmul(integral, push), W
