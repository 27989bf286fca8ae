"""What errors of the positions do to the torques that a robot's model predicts."""

from collections.abc import Callable
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
            found.append(self._summed(momentum))
        return np.stack(found, axis=-2)

    @cached_property
    def damping(self) -> Array:
        """Derivative of the torques by the velocities: Coriolis torques and friction."""
        state = self.signals.state
        qd = smoothed(state.qd, self.signals.fs)
        sliding = np.where(np.abs(qd) < SLIDING, np.copysign(SLIDING, qd), qd)
        return self._slopes(lambda step: (state.q, sliding + step), STEP_QD)

    @cached_property
    def stiffness(self) -> Array:
        """Derivative of the torques by the positions: gravity, and inertia that depends on them."""
        state = self.signals.state
        return self._slopes(lambda step: (state.q + step, state.qd), STEP_Q)

    def _slopes(self, moved: Callable[[Array], tuple[Array, Array]], step: float) -> Array:
        """Return central differences of the torques by each joint's position or velocity; `moved` adds steps to one of them."""
        found = []
        for i in range(self.basis.n):
            steps = np.zeros((self.basis.n, 1))
            steps[i] = step
            ahead, behind = (self._torques(*moved(sign * steps)) for sign in (1.0, -1.0))
            found.append((ahead - behind) / (2 * step))
        return np.stack(found, axis=-2)

    def _torques(self, q: Array, qd: Array) -> Array:
        qdd = self.signals.state.qdd
        return self._summed(self.basis.explicit(State(q, qd, lambda _: qdd)))

    def _summed(self, columns: Columns) -> Array:
        """Return columns times X, shape (..., joint, time)."""
        total = np.zeros_like(self.signals.state.q)
        for (row, name), column in columns.items():
            total[..., row, :] += column * self.X[..., self.basis.names.index(name), None]
        return total


def smoothed(x: Array, fs: float) -> Array:
    """Return `x`, shape (..., time), with noise above some 5 Hz taken out, and slow motion left as it is."""
    window = 2 * round(SMOOTHING * fs / 2) + 1
    return scipy.signal.savgol_filter(x, window, 2, mode="nearest") if window > 3 else x
