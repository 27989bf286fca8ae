"""How noise of a log's torques and positions reaches rows, and from there parameters."""

from dataclasses import dataclass, replace
from math import ceil

import numpy as np

from identify.arrays import Array
from identify.rows.grid import Grid, Kernel
from identify.rows.linearization import Linearization, smoothed
from identify.rows.row_map import RowMap


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
    total = np.sum(_squares(signals.torque_adjoint(_through_B(rows, of_c)), levels.torque), axis=-3)
    if not levels.position.any():
        return total
    of_c, smooth = signals.torque.average(of_c), _smooth(rows)
    of_torque = _through_B(smooth, of_c)
    momentum = None if of_e is None else _momentum(smooth, linear)
    for joint in range(signals.log.n):
        q, qd, qdd = (_times(of_torque, x[..., joint, :]) for x in (linear.stiffness, linear.damping, linear.inertia))
        if of_e is not None and momentum is not None:
            own = momentum[..., joint, :]
            qd = qd + _times(np.swapaxes(of_e, -2, -3), own) - _times(np.swapaxes(of_c, -2, -3), signals.s(own))
            qdd = np.zeros_like(qd)
        total = total + _squares(signals.position_adjoint((q, qd, qdd)), levels.position[..., joint])
    return total


def _smooth(rows: RowMap) -> RowMap:
    """Return a map with smoothed B: noise of the velocities in it, differentiated twice, would count as motion."""
    fs = rows.signals.fs
    return replace(rows, B={address: B if isinstance(B, float) else smoothed(B, fs) for address, B in rows.B.items()})


def _through_B(rows: RowMap, of_c: Array) -> Array:
    """Return what every torque counts for, shape (..., joint, m, time): B' of what every row does."""
    total = np.zeros((*of_c.shape[:-3], rows.signals.log.n, of_c.shape[-3], of_c.shape[-1]))
    for (row, joint), B in rows.B.items():
        factor = B if isinstance(B, float) else rows.signals.torque.average(B)[..., None, :]
        total[..., joint, :, :] += of_c[..., row, :] * factor
    return total


def _times(counts: Array, slopes: Array) -> Array:
    """Return the sum over k of counts (..., k, m, time) times slopes (..., k, time), shape (..., m, time)."""
    total = counts[..., 0, :, :] * slopes[..., 0, None, :]
    for k in range(1, counts.shape[-3]):
        total += counts[..., k, :, :] * slopes[..., k, None, :]
    return total


def _momentum(rows: RowMap, linear: Linearization) -> Array:
    """Return B M, shape (..., kind, joint of the position, time): what s^2 n is multiplied by in a row."""
    M = linear.inertia
    total = np.zeros((*M.shape[:-3], rows.outside.shape[-2], *M.shape[-2:]))
    for (row, joint), B in rows.B.items():
        total[..., row, :, :] += (B if isinstance(B, float) else B[..., None, :]) * M[..., joint, :, :]
    return total


def _squares(H: Array, level: Array) -> Array:
    """Return level^2 H H', shape (..., m, m), for H of shape (..., m, time)."""
    return level[..., None, None] ** 2 * np.matmul(H, np.swapaxes(H, -1, -2))


def torque_variance(rows: RowMap, level: Array) -> Array:
    """Return the variance that white noise of the torques gives every row, shape (..., kind, count).

    Exact where weights and B are constant over what a row looks at: prefilter and alignment then act on the response.

    Parameters
    ----------
    rows : RowMap
        How samples become rows.
    level : Array, shape (..., joint)
        Standard deviation of the noise [N m].
    """
    squares = np.zeros(rows.inside.shape)
    for (row, joint), B in rows.B.items():
        squares[..., row, :] += (level[..., joint, None] * rows.inside[..., row, :] * B) ** 2
    return rows.outside**2 * _window(rows.grid, torque_window(rows) ** 2).apply(squares)


def position_variance(rows: RowMap, level: Array, linear: Linearization) -> Array:
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
    """
    total = sum(variance for variance, _ in position_parts(rows, level, linear))
    return np.maximum(total, 0.0)


def position_parts(rows: RowMap, level: Array, linear: Linearization) -> list[tuple[Array, Array]]:
    """Return the terms of `position_variance`, shape (..., kind, count), and the windows that make them, shape (length,)."""
    signals = rows.signals
    g0 = level[..., None, :, None] * rows.inside[..., :, None, :] * _momentum(rows, linear)
    g1 = signals.s(g0)
    g2 = signals.s(g1)
    h0, h1, h2 = _responses(rows)

    def squares(h: Array, g: Array) -> Array:
        return rows.outside**2 * _window(rows.grid, h).apply(np.sum(g, axis=-2))

    mixed = squares(4 * h1**2, g1**2) + squares(2 * h0 * h2, g0 * g2)
    return [(squares(h2**2, g0**2), h2), (mixed, h1), (squares(h0**2, g2**2), h0)]


def torque_window(rows: RowMap) -> Array:
    """Return the weights of the torques around a row in it, prefilter and alignment included, shape (length,)."""
    return rows.signals.torque_adjoint(np.pad(rows.response, rows.signals.reach))


def correlations(window: Array, step: int) -> Array:
    """Return the correlation of sums of white noise over a window with those 0, 1, 2 ... times `step` later, shape (lag,)."""
    shifted = [window[: len(window) - lag] @ window[lag:] for lag in range(0, len(window), step)]
    return np.array(shifted) / max(float(shifted[0]), 1e-300)


def _responses(rows: RowMap) -> tuple[Array, Array, Array]:
    """Return the response to what is multiplied by g, by g s and by g s^2 of a position, prefilter included."""
    signals, by_parts = rows.signals, rows.rate_kernel
    reach = ceil((signals.prefilter.halo(signals.fs) + 2 * signals.differentiator.halo(signals.fs)) * signals.fs - 1e-9)
    h = np.pad(rows.response if by_parts is None else by_parts.weights, reach)
    zero, back = np.zeros_like(h), signals.position_adjoint
    plain, rate = back((h, zero, zero)), back((zero, h, zero))
    return (plain, rate, back((zero, zero, h))) if by_parts is None else (zero, plain, rate)


def _window(grid: Grid, weights: Array) -> Kernel:
    """Return a symmetric window about the samples of the rows, as far as a log goes: halos are rounded up one by one."""
    beyond = max(0, (len(weights) - 1) // 2 - grid.first)
    kept = weights[beyond : len(weights) - beyond]
    return Kernel(kept, (len(kept) - 1) // 2, grid)
