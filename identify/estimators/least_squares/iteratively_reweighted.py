"""Iteratively reweighted least squares."""

import warnings
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np
import numpy.typing as npt

from idbench.identify.arrays import TINY, Array, frozen
from idbench.identify.data.motion_log import MotionLog
from idbench.identify.errors import require_positive, require_whole
from idbench.identify.estimators.estimate import Estimate
from idbench.identify.estimators.estimator import AbstractEstimator
from idbench.identify.estimators.problem import Problem
from idbench.identify.estimators.simulating.row_products import Kinds, Solved, solve_with, with_weights
from idbench.identify.estimators.solution import Given
from idbench.identify.iterate import iterate
from idbench.identify.noise.white_noise import EXACT
from idbench.identify.signals.wild_samples import without_wild_samples

SIGMA = 1.4826  # Standard deviation of normal numbers over the median of their absolute values

ROUGH_Q, ROUGH_TAU = 1e-5, 1e-3
"""How rough positions and torques are at least, as a share of their standard deviation: torques bend, positions hardly."""

MIN_DEVIATION = 0.1  # Standard deviation of a row at least, over the median of its kind: of the edge of a mask little is known
SETTLED = 1e-3  # Step, in sigma of the paper's formula, below which parameters count as settled


@dataclass(frozen=True)
class IterativelyReweighted(AbstractEstimator):
    """Iteratively reweighted least squares (IRLS): joints weighted together, outliers left out.

    Samples of positions and torques that are wild, far off what their neighbours say, are replaced by that before the filter,
    which would spread them over all rows. Rows of an instant are made independent by the covariance of the joints' residuals,
    and weighted by Tukey's biweight of their size over its median: those beyond `tuning` standard deviations have no part. Both
    follow from the residuals of the round before (P. W. Holland and R. E. Welsch, "Robust regression using iteratively
    reweighted least-squares", Communications in Statistics A6 (1977) 813-827).
    """

    acronym: ClassVar[str] = "IRLS"

    tuning: float = 4.685
    """Standard deviations from which on a row has no part; 4.685 loses 5 % where errors are normal."""
    rounds: int = 50
    """Rounds at most."""

    def __post_init__(self) -> None:
        require_positive(tuning=self.tuning)
        require_whole(1, rounds=self.rounds)

    def solve(self, problem: Problem) -> Estimate:
        """Return the estimate of every run: X(k+1) = (W' w(k)^2 W)^-1 W' w(k)^2 Y, w(k) from the residuals Y - W X(k)."""
        clean = problem.with_logs([_clean(log) for log in problem.logs])
        rows, kinds = clean.rows, Kinds.of_rows(clean)
        Y, W = rows.Y * kinds.own, rows.W * kinds.own[..., None]
        begin = solve_with(kinds, rows.Y, rows.W, rows.W)
        begin = replace(begin, residual=begin.residual * kinds.own)
        least = np.maximum(EXACT * np.sqrt(np.mean(kinds.by_kind(Y) ** 2, axis=-2)), TINY)
        weights = _Weights.start(kinds, begin.residual, self.tuning, _relative(clean, kinds), least)

        def step(before: Solved) -> tuple[Solved, npt.NDArray[np.bool_]]:
            nonlocal weights
            weights = weights.again(before.residual)
            new = weights.solved(Y, W)
            return new, ~(np.max(np.abs(new.X - before.X) / new.sigma, axis=-1) >= SETTLED)  # runs that have none, too

        found, _ = iterate(step, begin, self.rounds, keep=Solved.where)
        G = found.G * kinds.own[..., None]
        return Estimate(clean, frozen(found.X), frozen(found.covariance), Given(G))


@dataclass(frozen=True, eq=False)
class _Weights:
    """What makes the rows of an instant independent, and how much each then counts."""

    kinds: Kinds
    """Of the rows."""
    tuning: float
    """Standard deviations from which on a row has no part."""
    root: Array
    """L^-1 with L L' the covariance of the residuals of an instant, shape (..., kind, kind)."""
    weight: Array
    """Tukey's, shape (..., instant, kind)."""
    relative: Array
    """Standard deviation that noise gives each row, over that of most of its kind: the mask leaves some less, shape (...,
    instant, kind)."""
    least: Array
    """Standard deviation that residuals have at least, shape (..., kind)."""

    @classmethod
    def start(cls, kinds: Kinds, residual: Array, tuning: float, relative: Array, least: Array) -> Self:
        """Return the weights of residuals, kind by kind."""
        seen = kinds.by_kind(kinds.own) > 0
        even = kinds.by_kind(residual) / relative
        scale = np.maximum(_spread(even, seen), least)
        weight = _tukey(even / scale[..., None, :], tuning) * seen
        return cls(kinds, tuning, np.eye(kinds.count) / scale[..., None, :], weight, relative, least)

    def again(self, residual: Array) -> Self:
        """Return the weights of other residuals."""
        left = self.kinds.by_kind(residual)
        counted = np.where(self._together[..., None], self.weight * left, 0.0)
        number = np.maximum(np.sum(self._together & (self.weight > 0).all(axis=-1), axis=-1), 1)
        C = np.matmul(np.swapaxes(counted, -1, -2), counted) / number[..., None, None]
        plain = _spread(left, self._seen)
        floor = np.maximum(1e-6 * plain, self.least)[..., None] ** 2 * np.eye(self.kinds.count)
        root = np.linalg.inv(np.linalg.cholesky(C + floor))
        white = replace(self, root=root)._white(left[..., None])[..., 0] / self.relative
        spread = _spread(white, self._together[..., None] & self._seen)
        root = root / np.maximum(spread, MIN_DEVIATION)[..., None]
        white = replace(self, root=root)._white(left[..., None])[..., 0] / self.relative
        return replace(self, root=root, weight=_tukey(white, self.tuning) * self._seen)

    def solved(self, Y: Array, W: Array) -> Solved:
        """Return the solution of rows, its G for the rows as they were."""
        both = np.concatenate([W, Y[..., None]], axis=-1)
        white = self._white(both.reshape(*both.shape[:-2], -1, self.kinds.count, both.shape[-1])) * self.weight[..., None]
        white = white.reshape(both.shape)
        found = with_weights(white[..., -1], white[..., :-1], np.asarray(np.any(white != 0, axis=-1), dtype=np.float64))
        G = found.G.reshape(*found.G.shape[:-2], -1, self.kinds.count, found.G.shape[-1]) * self.weight[..., None]
        residual = Y - np.matmul(W, found.X[..., None])[..., 0]
        return replace(found, G=self._white(G, adjoint=True).reshape(found.G.shape), residual=residual)

    @property
    def _seen(self) -> npt.NDArray[np.bool_]:
        return np.asarray(self.kinds.by_kind(self.kinds.own) > 0)

    @property
    def _together(self) -> npt.NDArray[np.bool_]:
        """Instants at which no row is void, shape (..., instant)."""
        return np.asarray(self._seen.all(axis=-1))

    def _white(self, x: Array, *, adjoint: bool = False) -> Array:
        """Return rows of instants, shape (..., instant, kind, m), made independent; of some alone divided by their spread."""
        root = np.swapaxes(self.root, -1, -2) if adjoint else self.root
        alone = 1 / np.sqrt(np.sum(np.linalg.inv(self.root) ** 2, axis=-1))
        whole = np.matmul(root[..., None, :, :], x)
        return np.where(self._together[..., None, None], whole, alone[..., None, :, None] * x)


def _clean(log: MotionLog) -> MotionLog:
    """Return a log without wild samples."""
    pairs = (log.q, ROUGH_Q), (log.tau, ROUGH_TAU)
    q, tau = (np.swapaxes(without_wild_samples(np.swapaxes(x, -1, -2), least)[0], -1, -2) for x, least in pairs)
    return replace(log, q=q, tau=tau)


def _relative(problem: Problem, kinds: Kinds) -> Array:
    """Return the standard deviation that noise gives each row, over the median of its kind, shape (..., instant, kind)."""
    variance = np.concatenate([part.covariance.variance for part in problem.parts], axis=-1)
    size = kinds.by_kind(np.sqrt(np.nan_to_num(variance)) * kinds.own)
    typical = _spread(size, kinds.by_kind(kinds.own) > 0)[..., None, :] / SIGMA
    return np.maximum(np.where(typical > 0, size / typical, 1.0), MIN_DEVIATION)


def _tukey(x: Array, tuning: float) -> Array:
    """Return the square roots of Tukey's biweight of residuals over their standard deviation."""
    return np.maximum(1 - (x / tuning) ** 2, 0.0)


def _spread(residual: Array, seen: npt.NDArray[np.bool_]) -> Array:
    """Return the standard deviation of residuals of every kind, shape (..., kind), from the median of their absolute values."""
    size = np.where(seen, np.abs(residual), np.nan)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a kind without rows
        found = SIGMA * np.nanmedian(size, axis=-2)
    return np.where(found > 0, found, 1.0)
