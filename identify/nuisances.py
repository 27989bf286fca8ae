"""Least squares with nuisance parameters, each in a group of rows of its own."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from idbench.identify.arrays import Array


@dataclass(frozen=True, eq=False)
class Nuisances:
    """Nuisance parameters z of groups of rows, such as initial states, which follow a step x of the parameters.

    Of r = J x + K z, with the precision P of what is known of z, the best z of every x is

        z(x) = N^-1 K' w (r - J x),   N = K' w K + P

    so that x is the solution of the rows J - K N^-1 K' w J (Schur complement).
    """

    K: Array
    """Sensitivity of every row to the nuisances of its group, shape (group, row, nuisance)."""
    P: float = 0.0
    """Precision of the prior of each nuisance parameter: one over its variance, where rows have a variance of 1/w."""
    w: Array | float = 1.0
    """Weights of the rows, shape (group, row)."""

    @cached_property
    def _weighted(self) -> Array:
        return np.swapaxes(self.K * np.expand_dims(self.w, (-2, -1) if np.ndim(self.w) == 0 else -1), -1, -2)

    @cached_property
    def _N(self) -> Array:
        return self._weighted @ self.K + self.P * np.eye(self.K.shape[-1])

    def drawn(self, z: Array) -> Array:
        """Return N^-1 P z of nuisance parameters z, shape (group, nuisance): the pull of their prior towards 0."""
        return np.asarray(np.linalg.solve(self._N, self.P * z[..., None])[..., 0])

    def following(self, x: Array) -> Array:
        """Return N^-1 K' w x of rows x, shape (group, row, m), as (group, nuisance, m)."""
        return np.asarray(np.linalg.solve(self._N, self._weighted @ x))

    def without(self, x: Array) -> Array:
        """Return rows x, shape (group, row, m), minus their projection on the nuisance columns."""
        return np.asarray(x - self.K @ self.following(x))
