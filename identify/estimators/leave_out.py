"""Least squares without each stretch of its rows, and how long stretches are."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Self

import numpy as np
import numpy.typing as npt

from idbench.identify.arrays import Array
from idbench.identify.estimators.log_rows import LogRows

STRETCH = 2.0  # Length of a stretch [s]: residuals of real robots are correlated over 0.2 to 3 s
FEWEST = 5  # Stretches at least; those of short logs are shorter

RIDGE, NOTHING = 1e-11, 1e-200
"""Share of its diagonal that is added to a matrix of products, so that what the other stretches do not show stays zero; squares
below which a column counts as none."""


@dataclass(frozen=True)
class Stretches:
    """Stretches of the logs of a fit, numbered through."""

    length: float
    """Of each [s]."""
    first: tuple[int, ...]
    """Number of the first stretch of each log, and one more: their count."""

    @classmethod
    def of(cls, parts: Sequence[LogRows]) -> Self:
        """Stretches of `STRETCH`, or of a fifth of all logs together where that is shorter."""
        times = [float(part.rows.time[-1]) for part in parts]
        length = min(STRETCH, sum(times) / FEWEST)
        return cls(length, tuple(np.cumsum([0, *(max(1, int(np.ceil(t / length))) for t in times)]).tolist()))

    @property
    def count(self) -> int:
        """Number of stretches."""
        return self.first[-1]

    def at(self, k: int, time: Array) -> npt.NDArray[np.intp]:
        """Numbers of the stretches in which instants [s] of log `k` lie; beyond its last row they are of its last stretch."""
        return np.minimum(self.first[k] + (time / self.length).astype(np.intp), self.first[k + 1] - 1)

    def products(self, parts: Sequence[LogRows], rows: Sequence[Array]) -> Array:
        """Products of the columns of rows of each part, shape (r, q), stretch by stretch, shape (stretch, q, q)."""
        pieces = [x[some] for k, (part, x) in enumerate(zip(parts, rows, strict=True)) for some in self.slices(k, part)]
        return np.array([piece.T @ piece for piece in pieces])

    def slices(self, k: int, part: LogRows) -> list[slice]:
        """Rows of each stretch of log `k`."""
        inner = np.searchsorted(self.at(k, part.rows.time), np.arange(self.first[k] + 1, self.first[k + 1]))
        return [slice(int(a), int(b)) for a, b in pairwise([0, *inner, len(part.rows.time)])]


def solved(products: Array, of: Array | None = None) -> Array:
    """Least-squares solutions from products of [W Y], shape (..., p + 1, p + 1), scaled as those of all rows are."""
    A, c = products[..., :-1, :-1], products[..., :-1, -1:]
    size = np.sqrt(np.maximum(np.diagonal(A if of is None else of[:-1, :-1], axis1=-2, axis2=-1), NOTHING))
    scaled = A / size[..., :, None] / size[..., None, :] + RIDGE * np.eye(A.shape[-1])
    return np.asarray(np.linalg.solve(scaled, c / size[..., None])[..., 0] / size)


def left_out(products: Array, known: Array | None = None) -> Array:
    """Estimates without each stretch, and that of all rows after them, shape (stretch + 1, p):

        X_b = (A - A_b)^-1 (c - c_b),   A_b = W_b' W_b,   c_b = W_b' Y_b   of rows made independent.

    Parameters
    ----------
    products : Array, shape (stretch, p + 1, p + 1)
        Those of [W_b Y_b].
    known : Array, shape (m, p + 1), optional
        Rows of what is known before, which are never left out.
    """
    every = products.sum(axis=0) + (0.0 if known is None else known.T @ known)
    return solved(np.concatenate([every - products, every[None]]), every)


def jackknife(without: Array, about: Array | float | None = None) -> Array:
    """Covariance of an estimate from B estimates without a stretch each, shape (stretch, ..., p), shape (..., p, p):

    J = (B - 1) / B sum over b of (X_b - mean) (X_b - mean)'

    or about the estimate of all rows, if that is given.
    """
    count = len(without)
    off = np.moveaxis(without - (without.mean(axis=0) if about is None else about), 0, -1)
    return np.asarray(np.matmul(off, np.swapaxes(off, -1, -2)) * ((count - 1) / count))


def moved(parts: Sequence[LogRows], X: Array, influence: Sequence[Array]) -> Array:
    """X_b - X of any estimate X = G' Y, which is `left_out` of rows made independent:

        X_b - X = -(I - g_b' w_b)^-1 g_b' e_b,   g = L' G,   [w e] = L^-1 [W Y - W X],   L L' being the covariance of the rows.

    Noise of positions is differentiated: sums of rows over a stretch then have it at the ends alone, and a covariance from
    stretches of such rows would be several times too large.

    Parameters
    ----------
    parts : sequence of LogRows
        Rows of the estimate. Leading axes are runs.
    X : Array, shape (..., p)
        The estimate.
    influence : sequence of Array, shape (..., r, p)
        G of each part.

    Returns
    -------
    Array, shape (stretch, ..., p)
    """
    stretches, found = Stretches.of(parts), list[Array]()
    one = (1 + RIDGE) * np.eye(X.shape[-1])
    for k, (part, G) in enumerate(zip(parts, influence, strict=True)):
        residual, white = (part.rows.Y - part.rows.predicted(X))[..., None], part.whitening
        g = white.whiten(white.C @ (G * white.kept[..., None]))
        rows = white.whiten(np.concatenate([part.rows.W, residual], axis=-1))
        for some in stretches.slices(k, part):
            products = np.matmul(np.swapaxes(g[..., some, :], -1, -2), rows[..., some, :])
            found.append(-np.linalg.solve(one - products[..., :-1], products[..., -1:])[..., 0])
    return np.array(found)
