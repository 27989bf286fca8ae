"""What errors of the positions do to the torques that a robot's model predicts."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from idbench.identify.arrays import HELD, Array, combined
from idbench.identify.basis.basis import Basis
from idbench.identify.basis.newton_euler import momenta, torques
from idbench.identify.signals.filters import between_samples, slide
from idbench.identify.signals.signals import Signals, State
from idbench.identify.signals.spectra import parabola

STEP_Q, STEP_QD = 1e-3, 0.05
"""Steps [rad, rad/s] of central differences: torques are sines of positions, and squares of velocities."""

SMOOTHING = 0.15  # Time [s] over which velocities are smoothed, by parabolas, before noise is propagated through them

KNOTS = 25.0
"""Frequency [Hz] at which slopes are computed; between them cubics go through them, since motion has little beyond 5 Hz."""

MAX_BLOCK, OF_A_LINK = 2_000_000, 100
"""Values of motions and forces that are kept at once, and how many a link has for each joint that is moved: 24 each in four
states."""

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
    """

    signals: Signals
    """The motion."""
    basis: Basis
    """The robot."""
    X: Array
    """Its parameters, shape (..., p)."""

    def at(self, places: Array) -> Slopes:
        """Return the slopes at places [samples], which may lie between samples."""
        return Slopes(*(_between(x, places, self._every) for x in self._at_knots))

    @property
    def _every(self) -> int:
        """Samples from one knot to the next."""
        return max(1, int(self.signals.fs / KNOTS))

    @cached_property
    def _at_knots(self) -> Slopes:
        state, last = self.signals.state, self.signals.state.q.shape[-1] - 1
        slow = smoothed(state.qd, self.signals.fs)
        # Beyond the last sample the motion stays as it is: a place to interpolate to.
        knots = np.minimum(np.arange(0, last + self._every, self._every), last)
        each = max(1, MAX_BLOCK // (self.basis.n**2 * OF_A_LINK * max(np.prod(state.q.shape[:-2], dtype=int), 1)))
        pieces = []
        for part in np.split(knots, range(each, len(knots), each)):
            conditions = {name: x[..., part] for name, x in state.conditions.items()}
            q, qd, qdd = (x[..., part] for x in (state.q, state.qd, state.qdd))
            pieces.append(slopes(self.basis, self.X, q, qd, qdd, slow[..., part], conditions))
        return Slopes(*(np.concatenate(each, axis=-1) for each in zip(*pieces, strict=True)))


def slopes(
    basis: Basis, X: Array, q: Array, qd: Array, qdd: Array, slow: Array, conditions: Mapping[str, Array] | None = None
) -> Slopes:
    """Return M(q) from the momenta at unit velocities, and central differences of the torques, joint by joint.

    X has shape (..., p), the motion (..., joint, time); damping is taken at the velocities `slow`, of that shape, too.
    """
    n = basis.n
    slides = np.where(np.abs(slow) < SLIDING, np.copysign(SLIDING, slow), slow)
    unit, still = np.eye(n).reshape(n, *[1] * (q.ndim - 2), n, 1), np.zeros((n, *q.shape))
    # All in one go: trees take as long for one sample as for hundreds.
    q_steps, qd_steps = STEP_Q * unit, STEP_QD * unit
    turned = np.concatenate([q + still, q + still, q + q_steps, q - q_steps])
    moved = np.concatenate([slides + qd_steps, slides - qd_steps, qd + still, qd + still])
    there = State(turned, moved, lambda _: np.broadcast_to(qdd, turned.shape), conditions or {})
    faster, slower, ahead, behind = np.split(torques(basis, there, X), 4)
    inertia = momenta(basis, State(q + still, unit + still, lambda x: x, conditions or {}), X)
    found = inertia, (faster - slower) / (2 * STEP_QD), (ahead - behind) / (2 * STEP_Q)
    return Slopes(*(np.moveaxis(x, 0, -2) for x in found))


def observation(basis: Basis, q: Array, qd: Array, qdd: Array) -> Array:
    """Return D(q, qd, qdd) of a motion, shape (..., joint, time), at every instant, shape (..., time, joint, p)."""
    found = np.zeros((*q.shape[:-2], q.shape[-1], basis.n, len(basis.names)))
    for (row, place), column in basis.explicit(State(q, qd, lambda _: qdd)).items():
        if place != HELD:
            found[..., row, place] = column
    return found


def friction_jumps(basis: Basis, X: Array, q: Array) -> Array:
    """Return the torque by which friction jumps where joints at positions q, shape (joint,), turn, shape (joint,) [N m]."""
    still = np.zeros((basis.n, 1))
    there = [State(q[:, None], still + v, lambda _: still) for v in (SLIDING, -SLIDING)]
    ahead, back = (combined(basis.explicit(state), X, np.zeros_like(still)) for state in there)
    return np.abs(ahead - back)[:, 0]


def smoothed(x: Array, fs: float) -> Array:
    """Return `x`, shape (..., time), with noise above some 5 Hz taken out, and slow motion left as it is."""
    window = 2 * round(SMOOTHING * fs / 2) + 1
    return slide(x, parabola(window)) if window > 3 else x


def _between(x: Array, places: Array, every: int) -> Array:
    """Return values of every so many samples, shape (..., knot), at places [samples], by cubics through four neighbours."""
    if every == 1:
        return between_samples(x, places)
    ends = np.concatenate([x[..., :1], x, x[..., -1:], x[..., -1:]], axis=-1)
    first = (places // every).astype(np.intp)
    s = places / every - first
    weights = -s * (1 - s) ** 2 / 2, 1 - (5 - 3 * s) * s**2 / 2, s * (1 + (4 - 3 * s) * s) / 2, -(s**2) * (1 - s) / 2
    total: Array = sum(w * ends[..., first + i] for i, w in enumerate(weights))
    return total
