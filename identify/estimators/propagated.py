"""The covariance that the noise of logs gives an estimate."""

from collections.abc import Callable, Iterator

import numpy as np

from identify.arrays import Array
from identify.estimators.problem import Problem
from identify.rows.row_map import RowMap
from identify.rows.rows import Rows

Influence = Callable[[Rows], Array]
"""Rows of a problem -> G, shape (..., rows, p), with which X = G' Y to first order."""


def noise_covariance(problem: Problem, influence: Influence) -> Array:
    """Return the covariance that the noise of a problem's logs gives an estimate X = G' Y, shape (..., p, p)."""
    total = np.zeros(())
    for rows, G in _influences(problem, influence):
        total = total + problem.noise.covariance(rows).of_sums(G)
    return total / problem.share


def bias_covariance(problem: Problem, influence: Influence) -> Array:
    """Return the square of the bias that noise of velocities near zero gives an estimate X = G' Y, shape (..., p, p)."""
    if problem.row_weights is None:
        return np.zeros(())
    bias = np.zeros(())
    for rows, G in _influences(problem, influence):
        bias = bias + np.matmul(np.swapaxes(G, -1, -2), problem.row_weights.bias(rows)[..., None]) / problem.share
    return np.matmul(bias, np.swapaxes(bias, -1, -2))


def excess(problem: Problem, X: Array, weights: Callable[[Rows], Array]) -> Array:
    """Return how many times the squares of weighted residuals are what noise makes of them, at least 1, shape (...).

    1 where rows of a kind are alike, since noise levels are theirs; elsewhere what the model does not explain counts, too.
    """
    if problem.row_weights is None:
        return np.ones(X.shape[:-1])
    p = len(problem.names)
    free = 1 - p / np.maximum(problem.factors.together.rows * problem.share, p + 1)
    return problem.row_weights.excess(X, weights, free)


def _influences(problem: Problem, influence: Influence) -> Iterator[tuple[RowMap, Array]]:
    """Yield the rows of each log with their G."""
    for part in problem.parts if problem.long else [problem.rows]:
        G = influence(part)
        for k, rows in enumerate(part.maps):
            yield rows, G[..., part.of_log(k), :]
