"""Least squares with unknowns that nobody asks for, each in a group of rows of its own."""

from dataclasses import dataclass
from functools import cached_property
from typing import final

import numpy as np

from idbench.identify.arrays import Array


@final
@dataclass(frozen=True, eq=False)
class Nuisances:
    """Unknowns z of groups of rows, such as where each begins, which follow the step x that is asked for.

    Of r = J x + K z, with the precision P of what is known of z, the best z of every x is

        z(x) = N^-1 K' w (r - J x),   N = K' w K + P

    so that x is solved with rows J - K N^-1 K' w J, which need not know z (Schur complement).
    """

    K: Array
    """Sensitivity of every row to the nuisances of its group, shape (group, row, nuisance)."""
    P: float = 0.0
    """What is known of each nuisance, one over its variance, where rows have a variance of 1/w."""
    w: Array | float = 1.0
    """Weights of the rows, shape (group, row)."""

    @cached_property
    def _weighted(self) -> Array:
        return np.swapaxes(self.K * np.expand_dims(self.w, (-2, -1) if np.ndim(self.w) == 0 else -1), -1, -2)

    @cached_property
    def _N(self) -> Array:
        return self._weighted @ self.K + self.P * np.eye(self.K.shape[-1])

    def drawn(self, z: Array) -> Array:
        """Return N^-1 P z of nuisances z, shape (group, nuisance): how far what is known of them draws them back to 0."""
        return np.asarray(np.linalg.solve(self._N, self.P * z[..., None])[..., 0])

    def following(self, x: Array) -> Array:
        """Return N^-1 K' w x of rows x, shape (group, row, m), as (group, nuisance, m)."""
        return np.asarray(np.linalg.solve(self._N, self._weighted @ x))

    def without(self, x: Array) -> Array:
        """Return rows x, shape (group, row, m), less what nuisances explain of them."""
        return np.asarray(x - self.K @ self.following(x))
