"""What errors of the positions do to the torques that a robot's model predicts."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from identify.arrays import Array, Columns
from identify.basis.basis import Basis
from identify.signals.signals import Signals
from identify.signals.state import State

STEP_Q, STEP_QD = 1e-3, 0.05
"""Steps [rad, rad/s] of central differences: torques are sines of positions, and squares of velocities."""

RATE = 50.0
"""Least frequency [Hz] at which slopes are computed; between they are interpolated, as motion has hardly more than 5 Hz."""

SMOOTHING = 0.15
"""Time [s] over which velocities are smoothed, by parabolas, before noise is propagated through them."""

SLIDING = 2 * STEP_QD
"""Least speed [rad/s] at which slopes are taken, so that friction does not change its sign within a difference."""


@dataclass(frozen=True, eq=False)
class Linearization:
    """What a small error n of the measured positions does to the torques that a robot's model predicts, sample by sample:

        error of D(q, qd, qdd) X = inertia s^2 n + damping s n + stiffness n

    All three have the shape (..., joint of the torque, joint of the position, time).

    Parameters
    ----------
    signals : Signals
        The motion.
    basis : Basis
        The robot.
    X : Array, shape (..., p)
        Its parameters.
    """

    signals: Signals
    basis: Basis
    X: Array

    @cached_property
    def inertia(self) -> Array:
        """M(q), from the momenta at unit velocities."""
        state, n = self.signals.state, self.basis.n
        found = []
        for i in range(n):
            unit = np.zeros_like(state.q)
            unit[..., i, :] = 1.0
            momentum = self.basis.momentum(State(state.q, unit, self.signals.s))
            found.append(self._summed(momentum, state.q))
        return np.stack(found, axis=-2)

    @cached_property
    def damping(self) -> Array:
        """Derivative of the torques by the velocities: Coriolis torques and friction."""
        qd = smoothed(self.signals.state.qd, self.signals.fs)
        return self._slopes(np.where(np.abs(qd) < SLIDING, np.copysign(SLIDING, qd), qd), 0.0, STEP_QD)

    @cached_property
    def stiffness(self) -> Array:
        """Derivative of the torques by the positions: gravity, and inertia that depends on them."""
        return self._slopes(self.signals.state.qd, STEP_Q, 0.0)

    def _slopes(self, qd: Array, step_q: float, step_qd: float) -> Array:
        """Return central differences of the torques by each joint's position or velocity, whichever has a step."""
        state, samples = self.signals.state, qd.shape[-1]
        some = np.unique(np.append(np.arange(0, samples, max(1, int(self.signals.fs / RATE))), samples - 1))
        q, qd, qdd = (x[..., some] for x in (state.q, qd, state.qdd))

        def torques(step: Array) -> Array:
            return self._summed(self.basis.explicit(State(q + step_q * step, qd + step_qd * step, lambda _: qdd)), q)

        units = np.eye(self.basis.n)[..., None]
        found = np.stack([torques(unit) - torques(-unit) for unit in units], axis=-2) / (2 * (step_q + step_qd))
        if len(some) == samples:
            return found
        return np.asarray(scipy.interpolate.interp1d(some, found)(np.arange(samples)), dtype=np.float64)

    def _summed(self, columns: Columns, q: Array) -> Array:
        """Return columns at positions `q` times X, shape (..., joint, time)."""
        total = np.zeros_like(q)
        for (row, name), column in columns.items():
            total[..., row, :] += column * self.X[..., self.basis.names.index(name), None]
        return total


def smoothed(x: Array, fs: float) -> Array:
    """Return `x`, shape (..., time), with noise above some 5 Hz taken out, and slow motion left as it is."""
    window = 2 * round(SMOOTHING * fs / 2) + 1
    return scipy.signal.savgol_filter(x, window, 2, mode="nearest") if window > 3 else x
