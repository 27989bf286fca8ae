"""Rows divided by the root of their covariance."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from idbench.identify.arrays import Array
from idbench.identify.noise.band_matrix import Band, Cholesky


@dataclass(frozen=True, eq=False)
class Whitening:
    """What makes the rows of one log independent, and of variance 1."""

    C: Band
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
