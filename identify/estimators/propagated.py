"""The covariance that the noise of logs gives an estimate."""

from collections.abc import Sequence

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.estimators.problem import Problem


def noise_covariance(problem: Problem, influence: Sequence[Array]) -> Array:
    """Return the covariance that the noise of a problem's logs gives an estimate X = G' Y, shape (..., p, p).

    Parameters
    ----------
    problem : Problem
        Logs and rows.
    influence : sequence of Array, shape (..., r, p)
        G of each of its parts.
    """
    each = zip(problem.parts, influence, strict=True)
    return sum((part.covariance.of_sums(G) for part, G in each), start=np.zeros(())) / problem.share


def bias_covariance(problem: Problem, influence: Sequence[Array]) -> Array:
    """Return the square of the bias that noise of velocities near zero gives an estimate X = G' Y, shape (..., p, p)."""
    if problem.alike:
        return np.zeros(())
    each = zip(problem.parts, influence, strict=True)
    bias = sum((np.matmul(np.swapaxes(G, -1, -2), part.bias[..., None]) for part, G in each), start=np.zeros(()))
    return np.matmul(bias, np.swapaxes(bias, -1, -2)) / problem.share**2


def excess(problem: Problem, X: Array, weights: Sequence[Array]) -> Array:
    """Return how many times the squares of weighted residuals are what noise makes of them, at least 1, shape (...).

    1 where rows of a kind are alike, since noise levels are theirs; elsewhere what the model does not explain counts, too.
    """
    if problem.alike:
        return np.ones(X.shape[:-1])
    squares, expected = np.zeros(()), np.zeros(())
    for part, weight in zip(problem.parts, weights, strict=True):
        counted = weight**2 * part.rows.valid
        squares = squares + np.sum(counted * (part.rows.Y - part.rows.predicted(X)) ** 2, axis=-1)
        expected = expected + np.sum(counted * part.variance, axis=-1)
    p = len(problem.names)
    free = 1 - p / np.maximum(problem.factors.together.rows * problem.share, p + 1)
    return np.maximum(np.divide(squares, expected * free, out=np.ones_like(squares), where=expected > 0), 1.0)
