"""How noise of a log's torques and positions reaches rows, and from there parameters."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil

import numpy as np
import scipy

from identify.arrays import Array, Columns
from identify.basis import Basis
from identify.rows.grid import Grid
from identify.rows.kernel import Kernel
from identify.rows.row_map import RowMap
from identify.signals.signals import Signals
from identify.signals.state import State

STEP_Q, STEP_QD = 1e-3, 0.05
"""Steps [rad, rad/s] of central differences: torques are sines of positions, and squares of velocities."""

SMOOTHING = 0.15
"""Time [s] over which velocities are smoothed, by parabolas, before noise is propagated through them."""

SLIDING = 2 * STEP_QD
"""Least speed [rad/s] at which slopes are taken, so that friction does not change its sign within a difference."""


@dataclass(frozen=True, eq=False)
class NoiseLevels:
    """Standard deviations of white noise in a log, joint by joint. Leading axes are runs.

    Parameters
    ----------
    torque : Array, shape (..., joint)
        Of the torques [N m].
    position : Array, shape (..., joint)
        Of the positions [rad].
    """

    torque: Array
    position: Array


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


def covariance(rows: RowMap, G: Array, levels: NoiseLevels, linear: Linearization) -> Array:
    """Return the covariance that the noise of a log gives sums of its rows, shape (..., m, m).

    The rows of every model are, to first order, those of B times the explicit model's error, so that one linearization serves
    all. A sum of rows is then a sum over the samples of torques and positions, whose noise is white.

    Parameters
    ----------
    rows : RowMap
        How samples become rows.
    G : Array, shape (..., rows, m)
        Weights of the rows in m sums.
    levels : NoiseLevels
        The noise.
    linear : Linearization
        Of the explicit model.
    """
    signals = rows.signals
    of_c, of_e = rows.adjoint(G)
    total = _summed_squares(signals.torque_adjoint(_through_B(rows, of_c)), levels.torque)
    if levels.position.any():
        of_c = signals.torque.average(of_c)
        of_torque = _through_B(_smooth(rows), of_c)
        q, qd, qdd = (_times(of_torque, slopes) for slopes in (linear.stiffness, linear.damping, linear.inertia))
        if of_e is not None:
            momentum = _momentum(_smooth(rows), linear)
            qd = qd + _times(np.swapaxes(of_e, -2, -3), momentum)
            qd, qdd = qd - _times(np.swapaxes(of_c, -2, -3), signals.s(momentum)), np.zeros_like(qd)
        total = total + _summed_squares(signals.position_adjoint((q, qd, qdd)), levels.position)
    return total


def _smooth(rows: RowMap) -> RowMap:
    """Return a map with smoothed B: noise of the velocities in it, differentiated twice, would count as motion."""
    fs = rows.signals.fs
    return replace(rows, B={address: B if isinstance(B, float) else smoothed(B, fs) for address, B in rows.B.items()})


def smoothed(x: Array, fs: float) -> Array:
    """Return `x`, shape (..., time), with noise above some 5 Hz taken out, and slow motion left as it is."""
    window = 2 * round(SMOOTHING * fs / 2) + 1
    return scipy.signal.savgol_filter(x, window, 2, mode="nearest") if window > 3 else x


def _through_B(rows: RowMap, of_c: Array) -> Array:
    """Return what every torque counts for, shape (..., joint, m, time): B' of what every row does."""
    joints = rows.signals.log.n
    total = np.zeros((*of_c.shape[:-3], joints, of_c.shape[-3], of_c.shape[-1]))
    for (row, joint), B in rows.B.items():
        factor = B if isinstance(B, float) else rows.signals.torque.average(B)[..., None, :]
        total[..., joint, :, :] += of_c[..., row, :] * factor
    return total


def _times(counts: Array, slopes: Array) -> Array:
    """Return sums over k of counts (..., k, m, time) times slopes (..., k, joint, time), shape (..., joint, m, time)."""
    total = np.zeros((*counts.shape[:-3], slopes.shape[-2], *counts.shape[-2:]))
    for k in range(counts.shape[-3]):
        total += counts[..., k, None, :, :] * slopes[..., k, :, None, :]
    return total


def _momentum(rows: RowMap, linear: Linearization) -> Array:
    """Return B M, shape (..., kind, joint of the position, time): what s^2 n is multiplied by in a row."""
    kinds = 1 + max(row for row, _ in rows.B)
    M = linear.inertia
    total = np.zeros((*M.shape[:-3], kinds, *M.shape[-2:]))
    for (row, joint), B in rows.B.items():
        total[..., row, :, :] += (B if isinstance(B, float) else B[..., None, :]) * M[..., joint, :, :]
    return total


def _summed_squares(H: Array, level: Array) -> Array:
    """Return the sum over joints of level^2 H H', shape (..., m, m), for H of shape (..., joint, m, time)."""
    return np.sum(level[..., None, None] ** 2 * np.matmul(H, np.swapaxes(H, -1, -2)), axis=-3)


def torque_variance(rows: RowMap, level: Array, *, masked: bool = True) -> Array:
    """Return the variance that white noise of the torques gives every row, shape (..., kind, count).

    Exact where weights and B are constant over what a row looks at: prefilter and alignment then act on the response.

    Parameters
    ----------
    rows : RowMap
        How samples become rows.
    level : Array, shape (..., joint)
        Standard deviation of the noise [N m].
    masked : bool
        With the weights of the mask; otherwise as if nothing were masked.
    """
    inside, outside = _weights(rows, masked)
    squares = np.zeros(inside.shape)
    for (row, joint), B in rows.B.items():
        squares[..., row, :] += (level[..., joint, None] * inside[..., row, :] * B) ** 2
    signals, pad = rows.signals, rows.signals.reach
    wide = signals.torque_adjoint(np.pad(rows.response, pad))
    return outside**2 * _window(rows.grid, wide**2).apply(squares)


def position_variance(rows: RowMap, level: Array, linear: Linearization, *, masked: bool = True) -> Array:
    """Return the variance that white noise of the positions gives every row, shape (..., kind, count), through M(q) s^2 alone.

    A row sums h g s^2 n, with h the response of the operator and g = w B M, which is (h g)'' n; of its square

        h''^2 g^2 + 4 h'^2 g'^2 + h^2 g''^2 + 2 h h'' g g''

    remains (the first two terms with a rate kernel, which has one derivative less), as products of h and h' with opposite
    symmetry cancel where g changes slowly.

    Parameters
    ----------
    rows : RowMap
        How samples become rows.
    level : Array, shape (..., joint)
        Standard deviation of the noise [rad].
    linear : Linearization
        Of the explicit model.
    masked : bool
        With the weights of the mask; otherwise as if nothing were masked.
    """
    signals = rows.signals
    inside, outside = _weights(rows, masked)
    g0 = level[..., None, :, None] * inside[..., :, None, :] * _momentum(rows, linear)
    g1 = signals.s(g0)
    g2 = signals.s(g1)
    h0, h1, h2 = _responses(rows)
    terms = (h2**2, g0**2), (4 * h1**2, g1**2), (h0**2, g2**2), (2 * h0 * h2, g0 * g2)
    total = sum(_window(rows.grid, h).apply(np.sum(g, axis=-2)) for h, g in terms)
    return outside**2 * np.maximum(total, 0.0)


def _weights(rows: RowMap, masked: bool) -> tuple[Array, Array]:
    return (rows.inside, rows.outside) if masked else (np.ones_like(rows.inside), np.ones_like(rows.outside))


def _responses(rows: RowMap) -> tuple[Array, Array, Array]:
    """Return the response to what is multiplied by g, by g s and by g s^2 of a position, prefilter included."""
    signals, kernel = rows.signals, rows.response
    reach = ceil((signals.prefilter.halo(signals.fs) + 2 * signals.differentiator.halo(signals.fs)) * signals.fs - 1e-9)
    h, zero = np.pad(kernel, reach), np.zeros(len(kernel) + 2 * reach)
    if rows.rate_kernel is None:
        return (
            signals.position_adjoint((h, zero, zero)),
            signals.position_adjoint((zero, h, zero)),
            signals.position_adjoint((zero, zero, h)),
        )
    by_parts = np.pad(rows.rate_kernel.weights, reach)
    return zero, signals.position_adjoint((by_parts, zero, zero)), signals.position_adjoint((zero, by_parts, zero))


def _window(grid: Grid, weights: Array) -> Kernel:
    """Return a symmetric window about the samples of the rows, as far as a log goes: halos are rounded up one by one."""
    beyond = max(0, (len(weights) - 1) // 2 - grid.first)
    kept = weights[beyond : len(weights) - beyond]
    return Kernel(kept, (len(kept) - 1) // 2, grid)
