"""The noise levels that make the rows of the explicit model most likely.

Restricted: the fit absorbs part of the noise, as many degrees of freedom as it has parameters. Plain maximum likelihood would
find variances that are too small, by half in a joint with twice as many rows as parameters.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import count
from typing import Self

import numpy as np
import numpy.typing as npt

from idbench.identify.arrays import Array
from idbench.identify.iterate import by_run, iterate
from idbench.identify.noise.band_matrix import BandMatrix, Cholesky
from idbench.identify.noise.propagation import NoiseLevels, NoisyRows
from idbench.identify.noise.white_noise import EXACT
from idbench.identify.rows.factors import Factor, triangular
from idbench.identify.rows.rows import Rows

ROUNDS, SETTLED = 20, 0.01  # Rounds at most, and change, in all that the levels make of the rows, at which they count as found
STILL = 0.02  # Change of X, in its sigma, at which the levels count as found

HASTY, HASTE = 1, 1.5
"""Rounds in which a square is multiplied by a power of the ratio: more than 1 is faster, 2 might swing for ever."""

FARTHEST = 64.0  # What a square is multiplied or divided by at most in one of the other rounds

RIDGE = 1e-6
"""Share of its own that is added to the information about each square: two that do the same to rows are both left there."""

LOWEST = 1e-3  # Share of the torque's rms at which its noise begins at least: what begins at nothing hardly grows
SMALLEST = 1e-9  # Noise of positions [rad] at least: rounding, of a log in single precision


def likely_levels(
    parts: Sequence[Rows], noisy: Sequence[NoisyRows], start: NoiseLevels, resolution: Array | float = 0.0
) -> NoiseLevels:
    """Return the noise of logs, the torques' by restricted maximum likelihood (REML) of the rows of the explicit model.

    The covariance of rows is C = sum of sigma_i^2 C_i over the torques and positions of all joints. The noise of positions is
    held: their differences show it, while rows would also take errors of the model for it. The likelihood of what
    the parameters do not explain is stationary where r' C^-1 C_i C^-1 r = trace of P C_i, with P = C^-1 - C^-1 W (W' C^-1
    W)^-1 W' C^-1 and r the residual (H. D. Patterson and R. Thompson, "Recovery of inter-block information when block sizes
    are unequal", Biometrika 58 (1971) 545-554). In the first round every sigma_i^2 is multiplied by a power of the ratio of
    the two; then come Newton's, by average information (A. R. Gilmour, R. Thompson and B. R. Cullis, "Average information
    REML: an efficient algorithm for variance parameter estimation in linear mixed models", Biometrics 51 (1995) 1440-1450).

    The torques begin at `start`, NaN in runs that cannot be solved; `resolution` is the standard deviation of their rounding,
    shape (..., joint), below which their noise cannot be [N m].
    """
    units = [each.units for each in noisy]
    joined = [rows.joined * each.kept[..., None] for rows, each in zip(parts, noisy, strict=True)]
    rms = rms_torque(noisy)
    least = least_level(rms, resolution) ** 2
    torque = np.where(np.isfinite(start.torque), np.maximum(start.torque, LOWEST * rms), start.torque)
    position = np.broadcast_to(np.maximum(start.position, SMALLEST), torque.shape)
    squares = likely(units, joined, np.nan_to_num(torque**2), least, position**2)
    return NoiseLevels(np.where(np.isfinite(torque), np.sqrt(squares), np.nan), start.position, start.repeats)


def rms_torque(noisy: Sequence[NoisyRows]) -> Array:
    """The rms of the torques [N m], shape (..., joint)."""
    return np.sqrt(sum(np.mean(each.to_rows.signals.torque.mean**2, axis=-1) for each in noisy) / len(noisy))


def least_level(rms: Array, resolution: Array | float) -> Array:
    """The least noise of torques of this rms and standard deviation of rounding that is believed [N m], shape (..., joint)."""
    return np.maximum(np.maximum(EXACT * rms, resolution), 1e-12)


def likely(
    units: Sequence[Sequence[BandMatrix]], joined: Sequence[Array], start: Array, least: Array, held: Array | None = None
) -> Array:
    """Return the numbers, not below `least`, shape (..., i), with which C = sum of number_i C_i makes rows most likely.

    C_i are `units`, [W Y], of shape (..., r, p + 1), is `joined`, both log by log. The numbers of the C_i after those are
    `held`, shape (..., k), optional.
    """
    held = np.zeros((*start.shape[:-1], 0)) if held is None else held
    number = count()

    def step(squares: Array) -> tuple[Array, npt.NDArray[np.bool_]]:
        slope = _Slope.at(units, joined, squares, held)
        factors = slope.ratio**HASTE if next(number) < HASTY else slope.newton(squares, least)
        moved = np.maximum(squares * factors, least)
        return moved, slope.small(squares, moved)

    return iterate(step, np.maximum(start, least), ROUNDS, keep=by_run)[0]


@dataclass(frozen=True, eq=False)
class _Slope:
    """How the likelihood of rows depends on the squares of its levels. Leading axes are runs."""

    found: Array
    """r' C^-1 C_i C^-1 r, shape (..., i)."""
    expected: Array
    """The trace of P C_i, shape (..., i)."""
    bend: Array
    """Average information, times 2: y' P C_i P C_j P y, shape (..., i, i)."""
    moves: Array
    """What X moves by, in its sigma, for a change of each square, shape (..., p, i)."""

    @classmethod
    def at(cls, units: Sequence[Sequence[BandMatrix]], joined: Sequence[Array], squares: Array, held: Array) -> Self:
        """Return the slopes at squares of levels, those that are `held` after the others."""
        every, free = np.concatenate([squares, held], axis=-1), squares.shape[-1]
        roots = [Cholesky.of(BandMatrix.weighted(parts, every)) for parts in units]
        white = [root.whiten(x) for root, x in zip(roots, joined, strict=True)]
        factor = Factor(triangular(np.concatenate(white, axis=-2)), np.array(0), ("",) * (joined[0].shape[-1] - 1))
        solvable = factor.determined
        X, inverse = factor.solution(solvable), factor.inverse(solvable)
        found, expected = np.zeros(squares.shape), np.zeros(squares.shape)
        bend, through_W = np.zeros((*squares.shape, squares.shape[-1])), np.zeros(())
        for root, parts, z in zip(roots, units, white, strict=True):
            solved = root.unwhiten(z)
            W, left = solved[..., :-1], solved[..., -1:] - np.matmul(solved[..., :-1], X[..., None])
            P = root.inverse() - BandMatrix.product(np.matmul(W, inverse), W, root.lower.shape[-1])
            products = [part @ left for part in parts[:free]]
            for i, (part, product) in enumerate(zip(parts[:free], products, strict=True)):
                found[..., i] += np.sum(left * product, axis=(-2, -1))
                expected[..., i] += P.trace_with(part)
            w = root.whiten(np.concatenate(products, axis=-1))
            bend += np.matmul(np.swapaxes(w, -1, -2), w)
            through_W = through_W + np.matmul(np.swapaxes(z[..., :-1], -1, -2), w)
        steps = np.matmul(inverse, through_W)
        bend -= np.matmul(np.swapaxes(through_W, -1, -2), steps)
        sigma = np.sqrt(np.diagonal(inverse, axis1=-2, axis2=-1))
        return cls(found, expected, bend, steps / sigma[..., None])

    @property
    def ratio(self) -> Array:
        """What is found over what is expected, shape (..., i); 1 in runs whose rows do not determine the parameters."""
        return np.divide(self.found, self.expected, out=np.ones_like(self.found), where=self.expected > 0)

    def newton(self, squares: Array, least: Array) -> Array:
        """Factors of the squares in a step by average information; those that would go below `least` stay."""
        held = (squares <= least) & (self.found <= self.expected)
        free = ~held & np.isfinite(self.found) & (self.expected > 0)
        both = free[..., :, None] & free[..., None, :]
        bend = np.where(both, self.bend * squares[..., :, None] * squares[..., None, :], 0.0)
        diagonal = np.diagonal(bend, axis1=-2, axis2=-1)
        own = np.where(free & (diagonal > 0), diagonal, 1.0)  # of levels that show nowhere nothing bends
        bend = bend + (~free + RIDGE * own)[..., :, None] * np.eye(bend.shape[-1])
        slope = np.where(free, (self.found - self.expected) * squares, 0.0)
        step = np.linalg.solve(bend, slope[..., None])[..., 0]
        return np.clip(1 + step, 1 / FARTHEST, FARTHEST)

    def small(self, squares: Array, moved: Array) -> npt.NDArray[np.bool_]:
        """True where a change of the squares moves neither X nor sigma significantly, shape (...)."""
        weight = np.maximum(np.nan_to_num(self.expected * squares), 0.0)
        total = np.sum(weight, axis=-1, keepdims=True)
        share = np.divide(weight, total, out=np.zeros_like(weight), where=total > 0)
        of_sigma = np.max(np.abs(moved / squares - 1) * share, axis=-1) < SETTLED
        of_X = np.max(np.abs(np.nan_to_num(np.matmul(self.moves, (moved - squares)[..., None]))), axis=(-2, -1)) < STILL
        return np.asarray(of_sigma & of_X)
