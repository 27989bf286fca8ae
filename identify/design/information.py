"""What a planned motion tells of the parameters, from few states, with its slope."""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np
import numpy.typing as npt
import scipy

from idbench.identify.arrays import HELD, Array
from idbench.identify.basis.basis import Basis
from idbench.identify.basis.block import FRICTION
from idbench.identify.data.motion_log import MotionLog
from idbench.identify.models import ExplicitModel
from idbench.identify.noise.linearization import Linearization, observation
from idbench.identify.noise.propagation import NoiseLevels, NoisyRows
from idbench.identify.rows.chain import Chain
from idbench.identify.signals.signals import State


def predicted_information(log: MotionLog, basis: Basis, X: Array, levels: NoiseLevels, chain: Chain) -> Array:
    """Return W' C^-1 W of the explicit model's rows, with the covariance C that noise will give them, shape (..., p, p).

    As generalized least squares has it, but for the noise levels, which are given here and estimated there.

    Parameters
    ----------
    log : MotionLog
        The motion without noise; of its torques only the meaning counts. Leading axes are motions.
    basis : Basis
        The robot.
    X : Array, shape (p,)
        Its parameters as far as they are known: they make the inertias by which noise of positions counts.
    levels : NoiseLevels
        Standard deviations of the noise, shape (joint,) each.
    chain : Chain
        Signal processing.

    Raises
    ------
    IdentificationError
        If the log is too short for the chain.
    """
    signals = replace(chain.signals(log), prefilter=chain.prefilter)  # as for the noisy log that the motion will have
    linear = Linearization(signals, basis, np.broadcast_to(X, (*log.q.shape[:-2], len(X))))
    rows = chain.rows(signals, basis, ExplicitModel())
    noisy, lead = NoisyRows(rows.maps[0], linear), (*log.q.shape[:-2], log.n)
    each = NoiseLevels(np.broadcast_to(levels.torque, lead), np.broadcast_to(levels.position, lead))
    white = noisy.whitening(each).whiten(rows.W)
    return np.matmul(np.swapaxes(white, -1, -2), white)


SLOW, TURNING = 0.1, 0.06
"""Speed [rad/s] below which a joint's rows count little, and time [s] about its reversals: masks leave them out."""

STEP = 1e-6  # Step [rad, rad/s] of differences of columns; accelerations enter them linearly, so that theirs are exact


@dataclass(frozen=True, eq=False)
class Information:
    """M = W' C^-1 W of motions, as generalized least squares has it, with one inertia matrix for all postures.

    Rows whose joint hardly moves count little. In the frequency domain (cosines: a motion need not be periodic) the covariance
    is a matrix of the joints at each frequency, S(f) = diag(torque noise^2) + w^4 M diag(position noise^2) M'; beyond the
    pass band of the rows nothing counts.
    """

    basis: Basis
    """The robot."""
    levels: NoiseLevels
    """Of its log, shape (joint,) each."""
    inertia: Array
    """Of the robot, on average over postures [kg m^2], shape (joint, joint)."""
    fs: float
    """Sampling frequency of the log [Hz]."""
    rate: float
    """Frequency of the states [Hz]."""
    cutoff: float
    """End of the pass band [Hz]."""

    def columns(self, motion: Array) -> Array:
        """Return the columns of D at a motion, shape (..., 4, time, joint), as (..., time, joint, p)."""
        return observation(self.basis, *_states(motion))

    def weighted(self, motion: Array) -> Array:
        """Return columns multiplied by how much their rows count, shape (..., time, joint, p)."""
        return self.columns(motion) * self.weight(motion)[..., None]

    def weight(self, motion: Array) -> Array:
        """Weights of the rows, qd^2 / (qd^2 + SLOW^2 + (TURNING qdd)^2), shape (..., time, joint)."""
        squares = motion[..., 1, :, :] ** 2
        return np.asarray(squares / (squares + SLOW**2 + (TURNING * motion[..., 2, :, :]) ** 2))

    def whitened(self, W: Array) -> Array:
        """Return C^-1 W of weighted columns, shape (..., time, joint, p)."""
        spectrum = scipy.fft.dct(W, type=2, axis=-3, norm="ortho")
        count = min(W.shape[-3], int(2 * self.cutoff / self.rate * W.shape[-3]) + 1)
        spectrum[..., count:, :, :] = 0.0
        spectrum[..., :count, :, :] = np.matmul(self._weights(W.shape[-3])[:count], spectrum[..., :count, :, :])
        return np.asarray(scipy.fft.idct(spectrum, type=2, axis=-3, norm="ortho"))

    def matrix(self, W: Array) -> Array:
        """Return W' C^-1 W of weighted columns, shape (..., p, p)."""
        flat = (*W.shape[:-3], -1, W.shape[-1])
        return np.matmul(np.swapaxes(W.reshape(flat), -1, -2), self.whitened(W).reshape(flat))

    def _weights(self, count: int) -> Array:
        """Return S^-1 at the frequencies of `count` cosines, shape (count, joint, joint)."""
        w = np.pi * self.rate * np.arange(count) / count
        by_position = self.inertia @ np.diag(self.levels.position**2) @ self.inertia.T
        S = np.diag(self.levels.torque**2) + w[:, None, None] ** 4 * by_position
        return np.asarray(np.linalg.inv(S) * self.fs / self.rate)

    @cached_property
    def _frictions(self) -> npt.NDArray[np.bool_]:
        """Which parameters are of friction, shape (p,)."""
        return np.array([parameter.kind in FRICTION for parameter in self.basis.parameters])

    def slope(self, motion: Array, of_rows: Array, of_torques: Array) -> Array:
        """Gradient of sums of products with columns by positions, velocities and accelerations, shape (3, time, joint).

        Weighted columns of a motion, shape (4, time, joint), are multiplied by `of_rows`, those of which frictions alone are
        weighted by `of_torques`, shape (time, joint, p) each.
        """
        n = self.basis.n
        steps = np.array([STEP, STEP, 1.0])
        copies = np.broadcast_to(motion, (3 * n + 1, *motion.shape)).copy()
        for order, j in product(range(3), range(n)):
            copies[1 + order * n + j, order, :, j] += steps[order]
        weight = self.weight(motion)
        sums = np.zeros((3 * n + 1, motion.shape[-2]))
        weighted = np.zeros(motion.shape[-2:])
        q, qd, qdd = _states(copies)
        for (row, place), column in self.basis.explicit(State(q, qd, lambda _: qdd)).items():
            if place == HELD:
                continue
            fading = of_rows[:, row, place].copy()
            whole = of_torques[:, row, place]
            if self._frictions[place]:
                fading, whole = fading + whole, np.zeros_like(whole)
            sums += column * (weight[:, row] * fading + whole)
            weighted[:, row] += column[0] * fading
        slopes = np.swapaxes((sums[1:] - sums[0]).reshape(3, n, -1) / steps[:, None, None], -1, -2)
        slopes[1:] += weighted * self._weight_slopes(motion)
        return slopes

    def _weight_slopes(self, motion: Array) -> Array:
        """Return derivatives of the weights by velocity and acceleration, shape (2, time, joint)."""
        qd, qdd = motion[1], motion[2]
        slow = SLOW**2 + (TURNING * qdd) ** 2
        total = (qd**2 + slow) ** 2
        return np.stack([2 * qd * slow / total, -2 * TURNING**2 * qdd * qd**2 / total])

    def torques(self, motion: Array, W: Array, X: Array) -> Array:
        """Torque per parameter, shape (..., time, joint, p), frictions fading at low speed."""
        return W * X * np.where(self._frictions, self.weight(motion)[..., None], 1.0)


def _states(motion: Array) -> tuple[Array, Array, Array]:
    """Return positions, velocities and accelerations of a motion, shape (..., joint, time) each."""
    q, qd, qdd = (np.ascontiguousarray(np.swapaxes(motion[..., i, :, :], -1, -2)) for i in range(3))
    return q, qd, qdd
