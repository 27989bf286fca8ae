"""The least error that any estimator can have: the Cramer-Rao bound."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.basis.basis import Basis
from idbench.identify.estimators.likelihood.cells import GAUSS, hermite
from idbench.identify.estimators.likelihood.joint_fit import MASK, UNKNOWN
from idbench.identify.estimators.likelihood.reversals import CREEP
from idbench.identify.noise.linearization import friction_jumps, observation, slopes
from idbench.identify.noise.propagation import NoiseLevels

AT_REST = 1e-3  # Share of a joint's rms speed below which it counts as at rest: a simulated contact creeps

Index = Any

TERMS = 8  # Terms of the exponential series: slopes times a period are well below 1


def cramer_rao(basis: Basis, X: Array, q: Array, qd: Array, fs: float, noise: NoiseLevels, *, reversals: bool = False) -> Array:
    """Return the covariance that no unbiased estimate of X from a log of this motion can go below, shape (..., p, p).

    The log has the torques, held for a period each, with white noise, and the positions at the beginning of each, with white
    noise. A Kalman filter of the motion's small errors gives the innovations e_k, their covariances S_k, and how they move with
    the parameters, E_k = de_k / dX: the Fisher information is the sum of E_k' S_k^-1 E_k (L. Ljung, "System Identification:
    Theory for the User", 2nd ed., 1999, section 7.4). The motion's start is not known, nor is the friction of a joint that
    rests or reverses.

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
    reversals : bool
        Whether friction is what its law says up to the instant at which a joint reverses, and from then on, so that only that
        of joints at rest is not known.
    """
    motion = _Motion.of(basis, X, q, qd, 1 / fs)
    A, B = motion.steps(motion.T)
    C = np.matmul(B, motion.W)
    weight = MASK.weight(np.moveaxis((qd[..., 1:, :] + qd[..., :-1, :]) / 2, -1, -2), fs)
    if reversals:
        weight = motion.through_reversals(A, B, C)
    variance = np.moveaxis((noise.torque[:, None] + (1 - weight) * UNKNOWN * motion.jump[:, None]) ** 2, -1, -2)
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
        slope = np.matmul(step, np.matmul(kept, slope)) - C[..., k, :, :]
    return np.linalg.pinv(information, hermitian=True)


@dataclass(frozen=True, eq=False)
class _Motion:
    """A motion in periods T: torques' slopes M, D and K, columns W on average, all (..., period, joint, joint or p)."""

    basis: Basis
    qd: Array
    middle: list[Array]
    M: Array
    D: Array
    K: Array
    W: Array
    jump: Array
    T: float

    @classmethod
    def of(cls, basis: Basis, X: Array, q: Array, qd: Array, T: float) -> Self:
        ends = np.stack([q[..., :-1, :], qd[..., :-1, :], q[..., 1:, :], qd[..., 1:, :]])
        at = ([np.moveaxis(np.tensordot(w, ends, axes=1), -1, -2) for w in hermite(s, T)] for s in (0.5, *GAUSS))
        middle, first, second = at
        M, D, K = (np.moveaxis(x, -1, -3) for x in slopes(basis, X, middle[0], middle[1], middle[2], middle[1]))
        W = (observation(basis, *first) + observation(basis, *second)) / 2
        return cls(basis, qd, middle, M, D, K, W, friction_jumps(basis, X, np.reshape(q, (-1, basis.n))[0]), T)

    def steps(self, T: float | Array, some: Index = ()) -> tuple[Array, Array]:
        """Transition matrices A of the error of (q, qd), and B of a torque, over times T of some periods."""
        M, D, K = (x[some] for x in (self.M, self.D, self.K))
        n, inverse = self.basis.n, np.linalg.inv(M)
        F = np.zeros((*M.shape[:-2], 2 * n, 2 * n))
        F[..., :n, n:] = np.eye(n)
        F[..., n:, :n], F[..., n:, n:] = -np.matmul(inverse, K), -np.matmul(inverse, D)
        push = np.concatenate([np.zeros_like(inverse), inverse], axis=-2)
        term = np.broadcast_to(np.eye(2 * n), F.shape)
        A, integral = np.zeros_like(F), np.zeros_like(F)
        for i in range(1, TERMS + 1):
            A, integral = A + term, integral + term * (T / i)
            term = np.matmul(F, term) * (T / i)
        return A, np.matmul(integral, push)

    def through_reversals(self, A: Array, B: Array, C: Array) -> Array:
        """Put reversals into the steps A, B and C = B W; return where friction is known, shape (..., joint, period).

        A joint that reverses after a share s of a period, from acceleration a to a - d, has velocities -a s T and (a - d)
        (1 - s) T beside it. An error v of its velocity moves the reversal by -v / a, and so changes accelerations by d v / a.
        """
        before, after = (np.moveaxis(x, -1, -2) for x in (self.qd[..., :-1, :], self.qd[..., 1:, :]))
        still = AT_REST * np.sqrt(np.mean(self.qd**2, axis=-2))[..., None]
        crosses = (before * after < 0) & (np.maximum(np.abs(before), np.abs(after)) > still)
        known = crosses | ((before * after > 0) & (np.minimum(np.abs(before), np.abs(after)) > still))
        together = np.sum(crosses, axis=-2, keepdims=True) > 1
        known &= ~(crosses & together)  # two in a period are rare: their friction counts as unknown
        crosses &= ~together
        *runs, joint, period = np.nonzero(crosses)
        some, every = (*runs, period), np.arange(len(period))
        sign = np.sign(after[crosses])
        step = np.linalg.inv(self.M[some])[every, :, joint] * (self.jump[joint] * sign)[:, None]
        early, late = np.abs(before[crosses]), np.abs(after[crosses])
        d = self.T * sign * step[every, joint]
        total = early + late + d
        share = 2 * early / (total + np.sqrt(total**2 - 4 * d * early))
        a = sign * early / (share * self.T)
        goes = np.abs(a) * self.T > d  # else it sticks
        known[(*runs, joint, period)] = goes
        jumps = np.broadcast_to(np.eye(2 * self.basis.n), (len(every), *2 * (2 * self.basis.n,))).copy()
        jumps[every, self.basis.n :, self.basis.n + joint] -= step / a[:, None]
        (A1, B1), (A2, B2) = (self.steps((x * self.T)[:, None, None], some) for x in (share, 1 - share))
        W1 = self._columns(some, joint, -sign, (1 - share)[:, None] * step)
        W2 = self._columns(some, joint, sign, -share[:, None] * step)
        through = np.matmul(A2, jumps)
        found = np.matmul(through, A1), np.matmul(through, B1) + B2, np.matmul(through, np.matmul(B1, W1)) + np.matmul(B2, W2)
        used = tuple(x[goes] for x in some)
        for whole, part in zip((A, B, C), found, strict=True):
            whole[used] = part[goes]
        return known

    def _columns(self, some: Index, joint: Index, sign: Array, change: Array) -> Array:
        """Return the columns in the middle of some periods, at other accelerations, where a joint moves with a sign."""
        q, qd, qdd = (np.moveaxis(x, -1, -2)[some].T.copy() for x in self.middle)
        qd[joint, np.arange(len(sign))] = sign * CREEP
        return observation(self.basis, q, qd, qdd + change.T)
