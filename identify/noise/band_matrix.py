"""Symmetric matrices with nothing far from their diagonal, and their Cholesky factors: linear in the length of a log."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
import numpy.typing as npt
from scipy.linalg import blas, lapack

from idbench.identify.arrays import Array
from idbench.identify.errors import IdentificationError

BLOCK, TOGETHER = 64, 32  # Unknowns that are solved for at once, at least, and blocks that are copied at once


@dataclass(frozen=True, eq=False)
class BandMatrix:
    """A symmetric band matrix C. Leading axes are runs."""

    lower: Array
    """At [j, d] what C has in row j + d of column j, shape (..., r, width)."""

    @classmethod
    def product(cls, x: Array, y: Array, width: int) -> Self:
        """Return so many diagonals of x y', which is symmetric, x and y of shape (..., r, m)."""
        left, right = (_in_pieces(z, width) for z in (x, np.broadcast_to(y, x.shape)))
        back = np.swapaxes(right, -1, -2)
        return cls(_as_band(np.matmul(left, back), np.matmul(left[..., 1:, :, :], back[..., :-1, :, :]), x.shape[-2]))

    def __sub__(self, other: Self) -> Self:
        return type(self)(self.lower - other.lower)

    @property
    def void(self) -> npt.NDArray[np.bool_]:
        """Which rows have no variance, and count as left out, shape (..., r)."""
        return np.asarray(self.lower[..., 0] == 0)

    @classmethod
    def weighted(cls, parts: Sequence[Self], weights: Array) -> Self:
        """Return the sum of matrices, each times a number for each run, shape (..., matrix)."""
        widest = max(parts, key=lambda part: part.lower.shape[-1]).lower
        total = np.zeros((*np.broadcast_shapes(weights.shape[:-1], widest.shape[:-2]), *widest.shape[-2:]))
        for i, part in enumerate(parts):
            total[..., : part.lower.shape[-1]] += part.lower * weights[..., i, None, None]
        return cls(total)

    def __matmul__(self, x: Array) -> Array:
        """Return C x, shape (..., r, m)."""
        size = self.lower.shape[-1]
        own, below = _in_blocks(self.lower, size)
        own = own + np.swapaxes(np.tril(own, -1), -1, -2)
        cut = _in_pieces(x, size)
        total = np.matmul(own, cut)
        total[..., :-1, :, :] += np.matmul(np.swapaxes(below, -1, -2), cut[..., 1:, :, :])
        total[..., 1:, :, :] += np.matmul(below, cut[..., :-1, :, :])
        return total.reshape(*total.shape[:-3], -1, x.shape[-1])[..., : x.shape[-2], :]

    def trace_with(self, other: Self) -> Array:
        """Return the trace of the product with another matrix, shape (...)."""
        width = min(self.lower.shape[-1], other.lower.shape[-1])
        both = np.einsum("...rd,...rd->...d", self.lower[..., :width], other.lower[..., :width])
        return 2 * np.sum(both, axis=-1) - both[..., 0]


@dataclass(frozen=True, eq=False)
class Cholesky:
    """The factor L of a band matrix L L'."""

    lower: Array
    """At [j, d] what L has in row j + d of column j; NaN in runs that have no factor, shape (..., r, width)."""

    @classmethod
    def of(cls, C: BandMatrix) -> Self:
        """Return the factor, NaN in runs where C is lost or not positive definite; void rows, without noise, are left.

        Raises
        ------
        IdentificationError
            If C is not positive definite, in all runs that there are.
        """
        found = np.full(C.lower.shape, np.nan)
        known = np.asarray(np.isfinite(C.lower).all(axis=(-2, -1)))
        refused = 0
        for run in np.ndindex(known.shape):
            if known[run]:
                band = C.lower[run].copy()
                band[:, 0] += C.void[run]
                root, failed = lapack.dpbtrf(band.T, lower=1, overwrite_ab=1)
                refused += failed > 0
                found[run] = np.nan if failed else root.T
        if refused and np.isnan(found[..., 0, 0]).all():
            raise IdentificationError(
                "the covariance of the rows is singular: there is too little noise to weigh them by; use WLS, or a log of "
                "an encoder or torque sensor with noise"
            )
        return cls(found)

    def whiten(self, x: Array) -> Array:
        """Return L^-1 x, shape (..., r, m)."""
        return self._solved(x, "N")

    def unwhiten(self, z: Array) -> Array:
        """Return L'^-1 z, shape (..., r, m)."""
        return self._solved(z, "T")

    def inverse(self) -> BandMatrix:
        """Return the inverse of the matrix, as far as that is not zero (Takahashi)."""
        r, width = self.lower.shape[-2:]
        own, below = _in_blocks(self.lower, width, rest=1.0)
        root = np.linalg.inv(own)
        back = np.swapaxes(root, -1, -2)
        gain = np.matmul(below, root[..., :-1, :, :])
        found, beside = np.matmul(back, root), np.zeros_like(gain)
        for k in reversed(range(below.shape[-3])):
            beside[..., k, :, :] = -np.matmul(found[..., k + 1, :, :], gain[..., k, :, :])
            found[..., k, :, :] -= np.matmul(np.swapaxes(gain[..., k, :, :], -1, -2), beside[..., k, :, :])
        return BandMatrix(_as_band(found, beside, r))

    def _solved(self, x: Array, which: str) -> Array:
        runs = np.broadcast_shapes(x.shape[:-2], self.lower.shape[:-2])
        every, roots = np.broadcast_to(x, (*runs, *x.shape[-2:])), np.broadcast_to(self.lower, (*runs, *self.lower.shape[-2:]))
        found = np.empty((*runs, *x.shape[-2:]))
        for run in np.ndindex(runs):
            found[run] = lapack.dtbtrs(roots[run].T, every[run], uplo="L", trans=which)[0]
        return found


def _in_blocks(lower: Array, size: int, rest: float = 0.0) -> tuple[Array, Array]:
    """Return blocks on the diagonal of a lower band matrix, (..., block, b, b), and below them, `rest` beyond its last row."""
    *runs, r, width = lower.shape
    count = -(-r // size)
    # Columns one place longer than they are wide begin, one by one, a row further down.
    slanted = np.zeros((*runs, count * size, 2 * size + 1))
    slanted[..., :r, :width] = lower
    slanted[..., r:, 0] = rest
    flat = slanted.reshape(*runs, count, -1)[..., : 2 * size * size]
    whole = np.swapaxes(flat.reshape(*runs, count, size, 2 * size), -1, -2)
    return whole[..., :size, :], whole[..., :-1, size:, :]


def _in_pieces(x: Array, size: int) -> Array:
    """Return rows, shape (..., r, m), in pieces, shape (..., piece, size, m), with zeros beyond the last."""
    *runs, r, m = x.shape
    count = -(-r // size)
    if count * size == r:
        return x.reshape(*runs, count, size, m)
    cut = np.zeros((*runs, count * size, m))
    cut[..., :r, :] = x
    return cut.reshape(*runs, count, size, m)


def _as_band(own: Array, below: Array, r: int) -> Array:
    """Return the lower band, of r rows, of blocks on the diagonal, shape (..., block, b, b), and of those below them."""
    size = own.shape[-1]
    whole = np.zeros((*own.shape[:-2], size, 2 * size))
    whole[..., :size], whole[..., :-1, :, size:] = np.swapaxes(own, -1, -2), np.swapaxes(below, -1, -2)
    flat = whole.reshape(*whole.shape[:-2], -1)
    slanted = np.concatenate([flat, np.zeros((*flat.shape[:-1], size))], axis=-1)
    return slanted.reshape(*whole.shape[:-3], -1, 2 * size + 1)[..., :r, :size]


def solve_lower(L: Array, right: Array) -> None:
    """Solve L x = b in place, L in bands as `dpbtrf` leaves it, for right sides of shape (size, m) in C order.

    Block by block, so that each is read once for all right sides: `dtbtrs` reads all of L for each.
    """
    (width, size), w = L.shape, L.shape[0] - 1
    block = max(BLOCK, w)
    own, beside = np.zeros((TOGETHER, block, block)), np.zeros((TOGETHER, w, w))
    bands = np.zeros((TOGETHER * block, width))
    for start in range(0, size, len(bands)):
        some = L.T[start : start + len(bands)]
        bands[: len(some)] = some
        each = bands.reshape(TOGETHER, block, width)
        for below in range(width):
            # Column by column, as BLAS has matrices; beside them the corner that the next block has in common.
            own.reshape(TOGETHER, -1)[:, below : (block - below) * block : block + 1] = each[:, : block - below, below]
            late = np.arange(block - below, block)
            beside[:, late + below - block, late - block + w] = each[:, late, below]
        for k, first in enumerate(range(start, start + len(some), block)):
            rows, later = right[first : first + block], right[first + block : first + block + w]
            n = len(rows)
            # The transpose of rows in C order is a matrix of BLAS's: x' L' = b'.
            blas.dtrsm(1.0, own[k, :n, :n].T, rows.T, side=1, lower=1, trans_a=1, overwrite_b=1)
            if len(later):
                later -= (beside[k] @ rows[-w:])[: len(later)]
