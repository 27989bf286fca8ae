"""How an estimate follows from the rows of a problem."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.estimators.log_rows import LogRows, split_by_log


class AbstractSolution(ABC):
    """X = G' Y, to first order."""

    @property
    def of_prior(self) -> Array:
        """Covariance of the error of X due to that of what is known before, shape (..., p, p)."""
        return np.zeros(())

    @abstractmethod
    def influence(self, parts: Sequence[LogRows]) -> list[Array]:
        """Return G of the rows of each part of the problem, shape (..., r, p)."""

    @abstractmethod
    def independent(self, parts: Sequence[LogRows]) -> list[Array] | None:
        """Return [W Y] made independent, shape (..., r, p + 1), each row by those before it, if X is their solution."""


@dataclass(frozen=True, eq=False)
class OfWeightedRows(AbstractSolution):
    """The solution of rows of which each has a weight."""

    weight: Array
    """Of every kind, shape (..., kind)."""
    inverse: Array
    """Of W' W of the weighted rows and what is known before, shape (..., p, p)."""
    scaled: bool
    """Whether rows that differ from those of their kind had a weight of their own, too."""
    known: Array | None = None
    """Rows of what is known before, in the unit of the weighted rows, shape (..., m, p + 1)."""
    noise: Array | None = None
    """Standard deviation of noise in that unit, shape (...)."""

    @property
    def of_prior(self) -> Array:
        """s^2 M P' P M with M = `inverse` and s the noise of the rows."""
        found = _of_prior(self.known, self.inverse)
        return found if self.noise is None else found * self.noise[..., None, None] ** 2

    def influence(self, parts: Sequence[LogRows]) -> list[Array]:
        """Return w^2 W (W' w^2 W)^-1."""
        each = zip(parts, self.weights(parts), strict=True)
        return [np.matmul(part.rows.W * (weight**2)[..., None], self.inverse) for part, weight in each]

    def independent(self, parts: Sequence[LogRows]) -> list[Array]:
        """Return the weighted rows."""
        return [part.rows.joined * weight[..., None] for part, weight in zip(parts, self.weights(parts), strict=True)]

    def weights(self, parts: Sequence[LogRows]) -> list[Array]:
        """Weights of the rows, shape (..., r)."""
        of_kinds = [np.tile(self.weight, part.rows.maps[0].grid.count) for part in parts]
        scaled = self.scaled and not parts[0].problem.alike
        return [weight * part.weights if scaled else weight for part, weight in zip(parts, of_kinds, strict=True)]


@dataclass(frozen=True, eq=False)
class OfWhitenedRows(AbstractSolution):
    """The solution of rows made independent by their covariance, W without what noise adds to it."""

    inverse: Array
    """Of W' C^-1 W and what is known before, shape (..., p, p)."""
    known: Array | None = None
    """Rows of what is known before, shape (..., m, p + 1)."""

    @property
    def of_prior(self) -> Array:
        """M P' P M with M = `inverse`."""
        return _of_prior(self.known, self.inverse)

    def influence(self, parts: Sequence[LogRows]) -> list[Array]:
        """Return C^-1 W (W' C^-1 W)^-1."""
        return [np.matmul(part.whitening.solve(part.unbiased.W), self.inverse) for part in parts]

    def independent(self, parts: Sequence[LogRows]) -> list[Array]:
        """Return L^-1 [W Y], L L' being the covariance."""
        return [part.whitening.whiten(part.unbiased.joined) for part in parts]


@dataclass(frozen=True, eq=False)
class Given(AbstractSolution):
    """The G, and the weights, of the rows of all parts, one below the other."""

    G: Array
    """Of all rows, shape (..., r, p)."""
    weight: Array | None = None
    """What rows were multiplied by, if X is their solution and each counts by itself, shape (..., r)."""

    def influence(self, parts: Sequence[LogRows]) -> list[Array]:
        """Return G as it was given."""
        return split_by_log(self.G, parts, -2)

    def independent(self, parts: Sequence[LogRows]) -> list[Array] | None:
        """Return the weighted rows."""
        if self.weight is None:
            return None
        weights = split_by_log(self.weight, parts, -1)
        return [part.rows.joined * weight[..., None] for part, weight in zip(parts, weights, strict=True)]


def _of_prior(known: Array | None, inverse: Array) -> Array:
    if known is None:
        return np.zeros(())
    P = np.matmul(known[..., :-1], inverse)
    return np.matmul(np.swapaxes(P, -1, -2), P)
