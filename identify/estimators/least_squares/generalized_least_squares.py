"""Generalized least squares."""

from dataclasses import dataclass
from typing import ClassVar, final
from weakref import WeakKeyDictionary

import numpy as np

from identify.arrays import Array, frozen
from identify.estimators.estimate import Estimate
from identify.estimators.estimator import AbstractEstimator, Need
from identify.estimators.problem import Problem
from identify.estimators.propagated import bias_covariance
from identify.noise.covariance import BandedCovariance
from identify.noise.restricted_likelihood import alike, likely
from identify.noise.whitening import Whitening, kept_rows
from identify.rows.factors import Factor, Status, triangular
from identify.rows.row_map import RowMap
from identify.rows.rows import Rows

LEAST = 1e-4
"""Share of the mean variance of rows that each part of it is at least."""


@final
@dataclass(frozen=True)
class GeneralizedLeastSquares(AbstractEstimator):
    """Generalized least squares (GLS), X = argmin (Y - W X)' C^-1 (Y - W X), with C the covariance that noise gives the rows.

    Noise of an encoder, twice differentiated, grows with the square of the frequency, and rows share that of neighbouring
    instants and other joints. Weighted least squares takes them for independent, and leaves a factor of four. C follows from
    the noise of each joint's torque and position (`NoisyRows`), whose levels make the explicit model's rows most likely
    (`likely_noise`). What noise of the positions adds to W on average is taken from it (`unbiased`). Rows of a model that
    multiplies torques by something that varies, such as the power model, have two independent errors beside that, as large as
    makes them most likely: one that is white, and what noise makes of friction where joints hardly move.
    """

    acronym: ClassVar[str] = "GLS"
    needs: ClassVar[frozenset[Need]] = frozenset({"factors"})

    def solve(self, problem: Problem) -> Estimate:
        """Return the estimate; of logs too long for their rows to be kept, pieces count as independent."""
        whitened = Whitened(problem)
        parts = [triangular(whitened(rows)) for rows in problem.every_part()]
        factor = Factor(triangular(np.concatenate(parts, axis=-2)), problem.factors.together.rows, problem.names)
        solvable = (problem.factors.together.status == Status.OK) & factor.determined
        inverse = factor.inverse(solvable)

        def influence(rows: Rows) -> Array:
            return np.matmul(whitened.solved(rows), inverse)

        covariance = frozen(inverse + bias_covariance(problem, influence))
        X, levels = frozen(factor.solution(solvable)), problem.likely_noise.levels
        return Estimate(problem, X, covariance, influence, whiten=whitened, honest=covariance, levels=levels)


def _covariances(problem: Problem, rows: RowMap) -> list[BandedCovariance]:
    """Return what noise makes of rows, and, beside it, errors of the same mean variance that are independent."""
    C = problem.likely_noise.covariance(rows)
    if problem.row_weights is None:
        return [C]
    mean, (count, kinds) = np.mean(C.variance, axis=-1, keepdims=True), C.bands.shape[-3:-1]
    rest = problem.row_weights.bias(rows) ** 2
    of_rest = np.mean(rest, axis=-1, keepdims=True)
    share = np.divide(rest, of_rest, out=np.ones_like(rest), where=of_rest > 0)
    return [C, *(BandedCovariance.of_variance(mean * x, kinds) for x in (np.ones(count * kinds), share))]


def _shares(problem: Problem) -> Array:
    """Return how much of each covariance makes the rows most likely, shape (..., 1 or 3)."""
    if problem.row_weights is None:
        return np.ones((1,))
    units, joined = [], []
    for rows, better in zip(problem.parts, problem.unbiased_parts, strict=True):
        kept, each = kept_rows(rows.maps[0]), _covariances(problem, rows.maps[0])
        units.append(alike([C.kept(kept).matrix for C in each]))
        joined.append(better.joined * kept[..., None])
    start = np.array([1.0, 0.1, 0.1])
    return likely(units, joined, np.broadcast_to(start, (*joined[0].shape[:-2], 3)), np.full(3, LEAST))


class Whitened:
    """Rows [W Y] made independent, and C^-1 W, log by log, W without the bias of noise in it."""

    def __init__(self, problem: Problem) -> None:
        self._problem, self._shares = problem, _shares(problem)
        self._known = WeakKeyDictionary[RowMap, tuple[Whitening, Array]]()

    def __call__(self, rows: Rows) -> Array:
        """Return L^-1 [W Y] of the rows of one log, or of a piece of it."""
        whitening, W = self._of(rows)
        return whitening.whiten(np.concatenate([W, rows.Y[..., None]], axis=-1))

    def whiten(self, rows: Rows, x: Array) -> Array:
        """Return L^-1 x of further columns x of the rows of one log, shape (..., r, m)."""
        return self._of(rows)[0].whiten(x)

    def solved(self, rows: Rows) -> Array:
        """Return C^-1 W of the rows of all logs, or of a piece of one."""
        parts = [rows] if len(rows.maps) == 1 else self._problem.parts
        return np.concatenate([whitening.solve(W) for whitening, W in map(self._of, parts)], axis=-2)

    def _of(self, rows: Rows) -> tuple[Whitening, Array]:
        (to_rows,) = rows.maps
        if to_rows not in self._known:
            kept, each = kept_rows(to_rows), _covariances(self._problem, to_rows)
            scaled = [C.scaled(self._shares[..., i]) for i, C in enumerate(each)]
            C = sum(scaled[1:], start=scaled[0])
            self._known[to_rows] = Whitening(C.kept(kept), kept), self._unbiased(rows).W
        return self._known[to_rows]

    def _unbiased(self, rows: Rows) -> Rows:
        known = zip(self._problem.parts, self._problem.unbiased_parts, strict=True)
        return next((better for part, better in known if part is rows), None) or self._problem.unbiased(rows)
