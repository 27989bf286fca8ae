"""Rows divided by the root of their covariance."""

from dataclasses import dataclass
from functools import cached_property
from weakref import WeakKeyDictionary

import numpy as np
import numpy.typing as npt

from identify.arrays import Array
from identify.noise.band_matrix import Cholesky
from identify.noise.covariance import BandedCovariance
from identify.noise.propagation import torque_paths
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
    def root(self) -> Cholesky:
        """The factor of the covariance of the rows that are kept; raise IdentificationError if it is singular."""
        return Cholesky.of(self.C.matrix)

    def whiten(self, x: Array) -> Array:
        """Return L^-1 x of rows x, shape (..., r, m), L L' being their covariance."""
        return self.root.whiten(x * self.kept[..., None])

    def solve(self, x: Array) -> Array:
        """Return C^-1 x, zero for rows that are left out, shape (..., r, m)."""
        return self.root.unwhiten(self.whiten(x)) * self.kept[..., None]


_KEPT: WeakKeyDictionary[RowMap, npt.NDArray[np.bool_]] = WeakKeyDictionary()


def kept_rows(rows: RowMap) -> npt.NDArray[np.bool_]:
    """Return which rows the mask leaves enough of, shape (..., r); computed once."""
    if rows not in _KEPT:
        one = np.ones(rows.signals.log.n)
        whole = torque_paths(rows.unmasked()).covariance(one).variance
        _KEPT[rows] = np.asarray(torque_paths(rows).covariance(one).variance > SEEN * whole)
    return _KEPT[rows]
