"""Cholesky factors of banded covariances, as block-tridiagonal matrices: linear in the length of a log."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from identify.arrays import Array
from identify.errors import IdentificationError
from identify.rows.banded import BandedCovariance


@dataclass(frozen=True, eq=False)
class Blocks:
    """A symmetric block-tridiagonal matrix. Leading axes are runs.

    Parameters
    ----------
    own : Array, shape (..., block, b, b)
        Blocks on the diagonal.
    next : Array, shape (..., block - 1, b, b)
        Blocks to the right of them.
    """

    own: Array
    next: Array

    @classmethod
    def of(cls, C: BandedCovariance, lags: int) -> Self:
        """Return a banded covariance in blocks of so many instants, at least as many as it has lags."""
        *runs, own, count, kinds, _ = C.bands.shape
        blocks = -(-count // lags)
        bands = np.zeros((*runs, lags, (blocks + 1) * lags, kinds, kinds))
        bands[..., :own, :count, :, :] = C.bands
        # whole[i, :, j, :] of instants i and j of a block, and of the one after it (j from lags on)
        whole = np.zeros((*runs, blocks, lags, kinds, 2 * lags, kinds))
        for lag in range(lags):
            of_lag = bands[..., lag, : blocks * lags, :, :].reshape(*runs, blocks, lags, kinds, kinds)
            for i in range(lags):
                whole[..., i, :, i + lag, :] = of_lag[..., i, :, :]
                if lag and i + lag < lags:
                    whole[..., i + lag, :, i, :] = np.swapaxes(of_lag[..., i, :, :], -1, -2)
        wide = whole.reshape(*runs, blocks, lags * kinds, 2 * lags * kinds)
        size = lags * kinds
        return cls(np.ascontiguousarray(wide[..., :size]), np.ascontiguousarray(wide[..., :-1, :, size:]))

    def cut(self, x: Array) -> Array:
        """Return rows, shape (..., r, m), as (..., block, b, m), with zeros after the last."""
        blocks, size = self.own.shape[-3:-1]
        padded = np.zeros((*x.shape[:-2], blocks * size, x.shape[-1]))
        padded[..., : x.shape[-2], :] = x
        return padded.reshape(*x.shape[:-2], blocks, size, x.shape[-1])

    def __matmul__(self, x: Array) -> Array:
        """Return the product with x, shape (..., block, b, m)."""
        total = np.matmul(self.own, x)
        total[..., :-1, :, :] += np.matmul(self.next, x[..., 1:, :, :])
        total[..., 1:, :, :] += np.matmul(np.swapaxes(self.next, -1, -2), x[..., :-1, :, :])
        return total

    def __add__(self, other: Self) -> Self:
        return type(self)(self.own + other.own, self.next + other.next)

    def scaled(self, level: Array) -> Self:
        """Return the matrix times a number for each run, shape (...)."""
        return type(self)(self.own * level[..., None, None, None], self.next * level[..., None, None, None])


@dataclass(frozen=True, eq=False)
class Cholesky:
    """The factor L of a block-tridiagonal matrix L L'.

    Parameters
    ----------
    inverse : Array, shape (..., block, b, b)
        Inverses of its blocks on the diagonal.
    below : Array, shape (..., block - 1, b, b)
        Transposes of the blocks below them.
    """

    inverse: Array
    below: Array

    @classmethod
    def of(cls, C: Blocks) -> Self:
        """Return the factor, NaN in runs where C is lost or not positive definite; void rows, without noise, are left.

        Raises
        ------
        IdentificationError
            If C is not positive definite, in all runs that there are.
        """
        void = np.diagonal(C.own, axis1=-2, axis2=-1) == 0
        own = C.own + np.eye(C.own.shape[-1]) * void[..., None, :]
        inverse, below = np.empty_like(own), np.empty_like(C.next)
        left = own[..., 0, :, :]
        for k in range(own.shape[-3]):
            inverse[..., k, :, :] = np.linalg.inv(_root(left))
            if k + 1 < own.shape[-3]:
                below[..., k, :, :] = np.matmul(inverse[..., k, :, :], C.next[..., k, :, :])
                left = own[..., k + 1, :, :] - np.matmul(np.swapaxes(below[..., k, :, :], -1, -2), below[..., k, :, :])
        return cls(inverse, below)

    def whiten(self, x: Array) -> Array:
        """Return L^-1 x, shape (..., block, b, m)."""
        z = np.empty(np.broadcast_shapes(x.shape, (*self.inverse.shape[:-2], 1, 1)))
        for k in range(x.shape[-3]):
            rest = x[..., k, :, :]
            if k:
                rest = rest - np.matmul(np.swapaxes(self.below[..., k - 1, :, :], -1, -2), z[..., k - 1, :, :])
            z[..., k, :, :] = np.matmul(self.inverse[..., k, :, :], rest)
        return z

    def unwhiten(self, z: Array) -> Array:
        """Return L'^-1 z, shape (..., block, b, m)."""
        x = np.empty_like(z)
        for k in reversed(range(z.shape[-3])):
            rest = z[..., k, :, :]
            if k + 1 < z.shape[-3]:
                rest = rest - np.matmul(self.below[..., k, :, :], x[..., k + 1, :, :])
            x[..., k, :, :] = np.matmul(np.swapaxes(self.inverse[..., k, :, :], -1, -2), rest)
        return x

    def inverse_blocks(self) -> Blocks:
        """Return the blocks of the inverse that the matrix itself has (Takahashi)."""
        blocks = self.inverse.shape[-3]
        own, following = np.empty_like(self.inverse), np.empty_like(self.below)
        for k in reversed(range(blocks)):
            root = self.inverse[..., k, :, :]
            back = np.swapaxes(root, -1, -2)
            if k + 1 == blocks:
                own[..., k, :, :] = np.matmul(back, root)
                continue
            gain = np.matmul(back, self.below[..., k, :, :])
            following[..., k, :, :] = -np.matmul(gain, own[..., k + 1, :, :])
            own[..., k, :, :] = np.matmul(back, root) - np.matmul(following[..., k, :, :], np.swapaxes(gain, -1, -2))
        return Blocks(own, following)

    def traces(self, parts: list[Blocks]) -> Array:
        """Return the trace of C^-1 times each matrix, shape (..., part)."""
        inverse = self.inverse_blocks()
        found = [
            np.sum(inverse.own * part.own, axis=(-3, -2, -1)) + 2 * np.sum(inverse.next * part.next, axis=(-3, -2, -1))
            for part in parts
        ]
        return np.stack(found, axis=-1)


def _root(A: Array) -> Array:
    """Return the Cholesky factors of matrices, shape (..., b, b), NaN where there is none; raise if no finite one has any."""
    lost = np.asarray(~np.isfinite(A).all(axis=(-2, -1)))
    usable = np.where(lost[..., None, None], np.eye(A.shape[-1]), A)
    try:
        found = np.linalg.cholesky(usable)
    except np.linalg.LinAlgError:
        found = np.stack([_root_or_lost(one) for one in usable.reshape(-1, *A.shape[-2:])]).reshape(A.shape)
        lost = np.asarray(lost | ~np.isfinite(found).all(axis=(-2, -1)))
        if lost.all():
            raise IdentificationError(
                "the covariance of the rows is singular: there is too little noise to weigh them by; take WLS, or a log of "
                "an encoder or torque sensor with noise"
            ) from None
    return np.where(lost[..., None, None], np.nan, found)


def _root_or_lost(A: Array) -> Array:
    try:
        return np.asarray(np.linalg.cholesky(A), dtype=np.float64)
    except np.linalg.LinAlgError:
        return np.full(A.shape, np.nan)
