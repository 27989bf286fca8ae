"""Least squares without each stretch of its rows, and how long stretches are."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self, final

import numpy as np
import numpy.typing as npt

from idbench.identify.arrays import TINY, Array
from idbench.identify.estimators.log_rows import LogRows

STRETCH = 2.0
"""Length of a stretch [s]: residuals of real robots are correlated over 0.2 to 3 s."""

FEWEST = 5
"""Stretches at least; those of short logs are shorter."""

SHOWN = 1e-12
"""Eigenvalue of the normal equations, over the largest, of columns scaled to unit length, below which rows do not show a
direction: a singular value of 1e-6."""


@final
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
        found = np.zeros((self.count, rows[0].shape[-1], rows[0].shape[-1]))
        for k, (part, x) in enumerate(zip(parts, rows, strict=True)):
            ends = np.searchsorted(self.at(k, part.rows.time), np.arange(self.first[k] + 1, self.first[k + 1]))
            for b, piece in enumerate(np.split(x, ends)):
                found[self.first[k] + b] = piece.T @ piece
        return found


def solved(products: Array) -> Array:
    """Least-squares solutions from products of [W Y], shape (..., p + 1, p + 1); directions that rows do not show are zero."""
    A, c = products[..., :-1, :-1], products[..., :-1, -1:]
    size = np.sqrt(np.maximum(np.diagonal(A, axis1=-2, axis2=-1), TINY))
    scaled = A / size[..., :, None] / size[..., None, :]
    return np.asarray((np.linalg.pinv(scaled, rcond=SHOWN, hermitian=True) @ (c / size[..., None]))[..., 0] / size)


def left_out(products: Array, known: Array | None = None) -> Array:
    """Estimates without each stretch, shape (stretch, p), and that of all rows:

        X_b = (A - A_b)^-1 (c - c_b),   A_b = W_b' W_b,   c_b = W_b' Y_b   of rows made independent.

    Parameters
    ----------
    products : Array, shape (stretch, p + 1, p + 1)
        Those of [W_b Y_b].
    known : Array, shape (m, p + 1), optional
        Rows of what is known before, which are never left out.
    """
    every = products.sum(axis=0) + (0.0 if known is None else known.T @ known)
    return solved(np.concatenate([every - products, every[None]]))
