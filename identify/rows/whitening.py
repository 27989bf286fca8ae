"""Rows divided by the root of their covariance."""

from dataclasses import dataclass
from functools import cached_property
from weakref import WeakKeyDictionary

import numpy as np
import numpy.typing as npt

from identify.arrays import Array
from identify.rows.banded import BandedCovariance
from identify.rows.block_tridiagonal import Blocks, Cholesky
from identify.rows.noise_propagation import torque_paths
from identify.rows.row_map import RowMap

SEEN = 0.05
"""Share of a row's variance that the mask must leave: of the edge of a mask alone, variance and model are not known well."""


@dataclass(frozen=True, eq=False)
class Whitening:
    """What makes the rows of one log independent, and of variance 1.

    Parameters
    ----------
    C : BandedCovariance
        Theirs.
    kept : bool array, shape (..., r)
        False for rows that are left out.
    """

    C: BandedCovariance
    kept: npt.NDArray[np.bool_]

    @cached_property
    def blocks(self) -> Blocks:
        """The covariance of the rows that are kept."""
        return Blocks.of(self.C, self.C.bands.shape[-4])

    @cached_property
    def root(self) -> Cholesky:
        """Its factor; raise IdentificationError if it is singular."""
        return Cholesky.of(self.blocks)

    def whiten(self, x: Array) -> Array:
        """Return L^-1 x of rows x, shape (..., r, m), L L' being their covariance."""
        z = self.root.whiten(self.blocks.cut(x * self.kept[..., None]))
        return z.reshape(*z.shape[:-3], -1, z.shape[-1])[..., : x.shape[-2], :]

    def solve(self, x: Array) -> Array:
        """Return C^-1 x, zero for rows that are left out, shape (..., r, m)."""
        z = self.root.unwhiten(self.root.whiten(self.blocks.cut(x * self.kept[..., None])))
        return z.reshape(*z.shape[:-3], -1, z.shape[-1])[..., : x.shape[-2], :] * self.kept[..., None]


_KEPT: WeakKeyDictionary[RowMap, npt.NDArray[np.bool_]] = WeakKeyDictionary()


def kept_rows(rows: RowMap) -> npt.NDArray[np.bool_]:
    """Return which rows the mask leaves enough of, shape (..., r); computed once."""
    if rows not in _KEPT:
        one = np.ones(rows.signals.log.n)
        whole = torque_paths(rows.unmasked()).covariance(one).variance
        _KEPT[rows] = np.asarray(torque_paths(rows).covariance(one).variance > SEEN * whole)
    return _KEPT[rows]
