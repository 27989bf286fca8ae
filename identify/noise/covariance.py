"""The covariance of rows, of which only those near each other in time are correlated."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
import numpy.typing as npt
from numpy.lib.stride_tricks import sliding_window_view

from idbench.identify.arrays import Array
from idbench.identify.noise.band_matrix import BandMatrix, Cholesky
from idbench.identify.rows.row_map import Grid, windowed


@dataclass(frozen=True, eq=False)
class Whitening:
    """What makes the rows of one log independent, and of variance 1."""

    C: BandMatrix
    """Covariance of those that are kept."""
    kept: npt.NDArray[np.bool_]
    """False for rows that are left out, shape (..., r)."""

    @cached_property
    def root(self) -> Cholesky:
        """The factor of the covariance of the rows that are kept; raise IdentificationError if it is singular."""
        return Cholesky.of(self.C)

    def whiten(self, x: Array) -> Array:
        """Return L^-1 x of rows x, shape (..., r, m), L L' being their covariance."""
        return self.root.whiten(x * self.kept[..., None])

    def solve(self, x: Array) -> Array:
        """Return C^-1 x, zero for rows that are left out, shape (..., r, m)."""
        return self.root.unwhiten(self.whiten(x)) * self.kept[..., None]


@dataclass(frozen=True, eq=False)
class BandedCovariance:
    """Covariance C of the rows of one log. Leading axes are runs."""

    bands: Array
    """Covariance of the row of a kind at an instant with that of another kind `lag` instants later, shape (..., lag, instant,
    kind, kind)."""

    @classmethod
    def of(
        cls, grid: Grid, windows: Sequence[Array], signals: Sequence[Array], outside: Array, most: int | None = None
    ) -> Self:
        """Return the covariance of rows that are sums over unit white noise n of several sources:

            row of sample k = outside sum over sources and t of n(t) sum over d of windows[d](t - k) signals[d](t)

        Parameters
        ----------
        grid : Grid
            The rows.
        windows : sequence of Array, shape (length,)
            With the sample of a row in the middle.
        signals : sequence of Array, shape (..., kind, source, time)
            As many.
        outside : Array, shape (..., kind, instant)
            Weights of the rows.
        most : int, optional
            Lags at most, such as 1 where the variances alone count; all that there are by default.
        """
        early, G = np.stack(windows), np.stack(signals)
        terms, length = early.shape
        before, lags = (length - 1) // 2, min(grid.count, -(-length // grid.step), most or grid.count)
        late = np.zeros((lags, terms, length))
        for lag, window in enumerate(late):
            window[:, lag * grid.step :] = early[:, : length - lag * grid.step]
        products = (early[:, None] * late[:, None]).reshape(lags, -1, length)
        runs, kinds = G.shape[1:-3], G.shape[-3]
        bands = np.zeros((*runs, lags, grid.count, kinds, kinds))
        reached = np.asarray((G != 0).any(axis=(*range(G.ndim - 3), -1)))
        for kind, own in enumerate(reached):  # all at once would take too much memory
            if len(others := np.flatnonzero((reached & own).any(axis=-1))):  # with noise of one source in common
                pairs = np.einsum("d...st,e...bst->...bdet", G[..., kind, :, :], G[..., others, :, :])
                found = windowed(pairs.reshape(*pairs.shape[:-3], -1, pairs.shape[-1]), products, before, grid)
                bands[..., kind, others] = np.moveaxis(found, -3, -1)
        return cls(bands * _weights(outside, lags))

    @classmethod
    def of_variance(cls, variance: Array, kinds: int) -> Self:
        """Return the covariance of independent rows of that variance, shape (..., r)."""
        return cls(variance.reshape(*variance.shape[:-1], 1, -1, kinds)[..., None] * np.eye(kinds))

    def __add__(self, other: Self) -> Self:
        few, many = sorted((self.bands, other.bands), key=lambda bands: bands.shape[-4])
        total = many.copy()
        total[..., : few.shape[-4], :, :, :] += few
        return type(self)(total)

    def kept(self, rows: npt.NDArray[np.bool_]) -> Self:
        """Return the covariance with zeros for rows that are not kept, shape (..., r)."""
        lags, count, kinds = self.bands.shape[-4:-1]
        by_row = np.swapaxes(rows.reshape(*rows.shape[:-1], count, kinds), -1, -2).astype(np.float64)
        return type(self)(self.bands * _weights(by_row, lags))

    @property
    def matrix(self) -> BandMatrix:
        """The covariance, rows in the order of Y."""
        *runs, lags, count, kinds, _ = self.bands.shape
        lower = np.zeros((*runs, count, kinds, lags * kinds))
        # What each row has in common with those of its instant and later ones.
        later = np.moveaxis(self.bands, (-4, -2), (-2, -3)).reshape(*runs, count, kinds, lags * kinds)
        for kind in range(kinds):
            lower[..., kind, : lags * kinds - kind] = later[..., kind, kind:]
        return BandMatrix(lower.reshape(*runs, count * kinds, lags * kinds))

    @property
    def variance(self) -> Array:
        """Variance of every row, in the order of Y: by time, then kind, shape (..., r)."""
        own = np.diagonal(self.bands[..., 0, :, :, :], axis1=-2, axis2=-1)
        return own.reshape(*own.shape[:-2], -1)

    def of_sums(self, G: Array) -> Array:
        """Return G' C G, shape (..., m, m): the covariance of sums of rows with weights G, shape (..., r, m)."""
        lags, count, kinds = self.bands.shape[-4:-1]
        G = G.reshape(*G.shape[:-2], count, kinds, G.shape[-1])
        total = np.zeros(())
        for lag in range(lags):
            later = np.matmul(self.bands[..., lag, : count - lag, :, :], G[..., lag:, :, :])
            sums = np.matmul(np.swapaxes(_flat(G[..., : count - lag, :, :]), -1, -2), _flat(later))
            total = total + (sums + np.swapaxes(sums, -1, -2) if lag else sums)
        return total


def _weights(outside: Array, lags: int) -> Array:
    """Return products of weights, shape (..., kind, instant), of rows with those of later ones, as bands; 0 beyond the last."""
    beyond = np.concatenate([outside, np.zeros((*outside.shape[:-1], lags - 1))], axis=-1)
    later = np.moveaxis(sliding_window_view(beyond, outside.shape[-1], axis=-1), -3, -1)
    return np.swapaxes(outside, -1, -2)[..., None, :, :, None] * later[..., None, :]


def _flat(x: Array) -> Array:
    """Return an array of shape (..., instant, kind, m) as (..., rows, m)."""
    return x.reshape(*x.shape[:-3], -1, x.shape[-1])
