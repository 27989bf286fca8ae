"""The noise levels that make the rows of the explicit model most likely."""

from collections.abc import Callable, Sequence

import numpy as np

from identify.arrays import Array
from identify.rows.block_tridiagonal import Blocks, Cholesky
from identify.rows.factors import Factor, triangular
from identify.rows.linearization import Linearization
from identify.rows.noise_propagation import NoiseLevels, NoisyRows, position_paths, torque_paths
from identify.rows.rows import Rows
from identify.rows.whitening import kept_rows
from identify.signals.signals import Signals

ROUNDS, SETTLED = 20, 0.01
"""Rounds at most, and change, in all that the levels make of the rows, at which they count as found."""

HASTE = 1.5
"""Power of the ratio by which a level is multiplied: more than 1 is faster, 2 might swing for ever."""

LOWEST = 1e-3
"""Share of the torque's rms at which its noise begins at least: what begins at nothing hardly grows."""

EXACT = 1e-5
"""Share of the torque's rms that counts as noise at least: no model of a robot is better."""

SMALLEST = 1e-9
"""Noise of positions [rad] at least: rounding, of a log in single precision."""


def likely_noise(parts: Sequence[Rows], start: NoiseLevels, linear: Callable[[Signals], Linearization]) -> NoisyRows:
    """Return the noise of logs by restricted maximum likelihood (REML), from the rows of their explicit model.

    The covariance of rows is C = sum of sigma_i^2 C_i over the torques and positions of all joints. The likelihood of what the
    parameters leave over is stationary where r' C^-1 C_i C^-1 r = trace of P C_i, with P = C^-1 - C^-1 W (W' C^-1 W)^-1 W' C^-1
    and r the residual (H. D. Patterson and R. Thompson, "Recovery of inter-block information when block sizes are unequal",
    Biometrika 58 (1971) 545-554). In each round every sigma_i^2 is multiplied by a power of the ratio of the two, which keeps
    it positive.

    Parameters
    ----------
    parts : sequence of Rows
        Rows of the explicit model, log by log.
    start : NoiseLevels
        Where to begin; NaN in runs that cannot be solved.
    linear : callable
        Returns the linearization of the explicit model about signals.
    """
    units = [_units(rows, linear(rows.maps[0].signals)) for rows in parts]
    joined = [rows.joined * kept_rows(rows.maps[0])[..., None] for rows in parts]
    tau = [rows.maps[0].signals.torque.mean for rows in parts]
    rms = np.sqrt(sum(np.mean(one**2, axis=-1) for one in tau) / len(parts))
    least = np.concatenate([np.maximum(EXACT * rms, 1e-12), np.full(rms.shape, SMALLEST)], axis=-1) ** 2
    begin = np.where(np.isfinite(start.torque), np.maximum(start.torque, LOWEST * rms), start.torque)
    levels = np.concatenate([begin, np.broadcast_to(start.position, start.torque.shape)], axis=-1)
    squares = likely(units, joined, np.nan_to_num(levels**2), least)
    torque, position = np.split(np.where(np.isfinite(levels), np.sqrt(squares), np.nan), 2, axis=-1)
    return NoisyRows(NoiseLevels(torque, position), linear)


def likely(units: Sequence[list[Blocks]], joined: Sequence[Array], start: Array, least: Array) -> Array:
    """Return the numbers, not below `least`, shape (..., i), with which C = sum of number_i C_i makes rows most likely.

    Parameters
    ----------
    units : sequence of list of Blocks
        C_i, log by log.
    joined : sequence of Array, shape (..., r, p + 1)
        [W Y], log by log.
    start, least : Array, shape (..., i)
        Where to begin, and where to end.
    """
    squares = np.maximum(start, least)
    settled = np.zeros(squares.shape[:-1], dtype=bool)
    for _ in range(ROUNDS):
        ratio, share = _ratio(units, joined, squares)
        moved = np.where(settled[..., None], squares, np.maximum(squares * ratio**HASTE, least))
        settled |= np.max(np.abs(moved / squares - 1) * share, axis=-1) < SETTLED  # each run by itself, as if it were alone
        squares = moved
        if settled.all():
            break
    return squares


def _units(rows: Rows, linear: Linearization) -> list[Blocks]:
    """Return the covariances of rows by unit noise of the torques, and of the positions, joint by joint."""
    (to_rows,) = rows.maps
    each = [*torque_paths(to_rows).each(), *position_paths(to_rows, linear).each()]
    lags, kept = max(C.bands.shape[-4] for C in each), kept_rows(to_rows)
    return [Blocks.of(C.kept(kept), lags) for C in each]


def _ratio(units: Sequence[list[Blocks]], joined: Sequence[Array], squares: Array) -> tuple[Array, Array]:
    """Return r' C^-1 C_i C^-1 r over the trace of P C_i, and that trace's share of all, shape (..., source).

    1 in runs whose rows do not determine the parameters.
    """
    roots = [Cholesky.of(_sum(parts, squares)) for parts in units]
    white = [root.whiten(parts[0].cut(x)) for root, parts, x in zip(roots, units, joined, strict=True)]
    names = ("",) * (joined[0].shape[-1] - 1)
    factor = Factor(triangular(np.concatenate([_rows(z) for z in white], axis=-2)), np.array(0), names)
    solvable = factor.determined
    X, inverse = factor.solution(solvable), factor.inverse(solvable)
    found, expected = np.zeros(squares.shape), np.zeros(squares.shape)
    for root, parts, z in zip(roots, units, white, strict=True):
        solved = root.unwhiten(z)
        of_W, of_Y = solved[..., :-1], solved[..., -1:]
        left = of_Y - np.matmul(of_W, X[..., None, :, None])
        expected += root.traces(parts)
        for i, part in enumerate(parts):
            found[..., i] += np.sum(left * (part @ left), axis=(-3, -2, -1))
            taken = np.sum(np.matmul(np.swapaxes(of_W, -1, -2), part @ of_W), axis=-3)
            expected[..., i] -= np.sum(taken * inverse, axis=(-2, -1))
    ratio = np.divide(found, expected, out=np.ones_like(found), where=expected > 0)
    weight = np.maximum(np.nan_to_num(expected * squares), 0.0)
    total = np.sum(weight, axis=-1, keepdims=True)
    return ratio, np.divide(weight, total, out=np.zeros_like(weight), where=total > 0)


def _sum(parts: list[Blocks], squares: Array) -> Blocks:
    total = parts[0].scaled(squares[..., 0])
    for i, part in enumerate(parts[1:], 1):
        total = total + part.scaled(squares[..., i])
    return total


def _rows(z: Array) -> Array:
    """Return blocks of rows, shape (..., block, b, m), one below the other."""
    return z.reshape(*z.shape[:-3], -1, z.shape[-1])
