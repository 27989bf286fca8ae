"""What errors of the positions do to the torques that a robot's model predicts."""

from dataclasses import dataclass, field
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import scipy

from identify.arrays import Array, Columns, frozen
from identify.basis.basis import Basis
from identify.signals.signals import Signals
from identify.signals.state import State
from identify.signals.stencils import slide

STEP_Q, STEP_QD = 1e-3, 0.05
"""Steps [rad, rad/s] of central differences: torques are sines of positions, and squares of velocities."""

SMOOTHING = 0.15
"""Time [s] over which velocities are smoothed, by parabolas, before noise is propagated through them."""

SLIDING = 2 * STEP_QD
"""Least speed [rad/s] at which slopes are taken, so that friction does not change its sign within a difference."""


class Slopes(NamedTuple):
    """How torques answer to positions, shape (..., joint of the torque, joint of the position, time) each."""

    inertia: Array
    """M(q)."""

    damping: Array
    """Derivative of the torques by the velocities: Coriolis torques and friction."""

    stiffness: Array
    """Derivative of the torques by the positions: gravity, and inertia that depends on them."""


@dataclass(frozen=True, eq=False)
class Linearization:
    """What a small error n of the measured positions does to the torques that a robot's model predicts, sample by sample:

        error of D(q, qd, qdd) X = inertia s^2 n + damping s n + stiffness n

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
    _known: dict[tuple[int, int], Slopes] = field(default_factory=dict, repr=False)

    def at(self, some: slice) -> Slopes:
        """Return the slopes at some samples, each computed once."""
        key = int(some.start), int(some.step)
        if key not in self._known:
            self._known[key] = self._slopes(some)
        return self._known[key]

    def _slopes(self, some: slice) -> Slopes:
        """Return M(q) from the momenta at unit velocities, and central differences of the torques, joint by joint."""
        state, n = self.signals.state, self.basis.n
        q, qd, qdd = (x[..., some] for x in (state.q, state.qd, state.qdd))
        slow = smoothed(state.qd, self.signals.fs)[..., some]
        slides = np.where(np.abs(slow) < SLIDING, np.copysign(SLIDING, slow), slow)
        unit = np.eye(n).reshape(n, *[1] * (q.ndim - 2), n, 1)

        def torques(step_q: float, step_qd: float, velocity: Array) -> Array:
            still = np.zeros_like(q + unit)
            there = State(q + step_q * unit + still, velocity + step_qd * unit + still, lambda _: qdd + still)
            return self._summed(self.basis.explicit(there), there.q)

        at_rest = State(q + 0 * unit, unit + 0 * q, self.signals.s)
        inertia = self._summed(self.basis.momentum(at_rest), at_rest.q)
        damping = (torques(0.0, STEP_QD, slides) - torques(0.0, -STEP_QD, slides)) / (2 * STEP_QD)
        stiffness = (torques(STEP_Q, 0.0, qd) - torques(-STEP_Q, 0.0, qd)) / (2 * STEP_Q)
        return Slopes(*(np.moveaxis(found, 0, -2) for found in (inertia, damping, stiffness)))

    def _summed(self, columns: Columns, q: Array) -> Array:
        """Return columns at positions `q` times X, shape (..., joint, time)."""
        total = np.zeros_like(q)
        for (row, name), column in columns.items():
            total[..., row, :] += column * self.X[..., self.basis.names.index(name), None]
        return total


def smoothed(x: Array, fs: float) -> Array:
    """Return `x`, shape (..., time), with noise above some 5 Hz taken out, and slow motion left as it is."""
    window = 2 * round(SMOOTHING * fs / 2) + 1
    return slide(x, _parabola(window)) if window > 3 else x


@lru_cache(maxsize=16)
def _parabola(window: int) -> Array:
    """Return what samples count for in the middle of the parabola through them (Savitzky and Golay)."""
    return frozen(scipy.signal.savgol_coeffs(window, 2))
