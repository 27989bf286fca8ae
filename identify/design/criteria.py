"""What is asked of a motion: functions of its information matrix, and their slopes."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from idbench.identify.arrays import TINY, Array

SINGULAR = 1e-13  # Share of the largest eigenvalue, of scaled information, below which a direction counts as not told
HIDDEN = 1e-6  # Share of a parameter in such directions from which on it is unknown


class AbstractCriterion(ABC):
    """A function of the information M = W' C^-1 W; less is better."""

    noise: ClassVar[bool] = True
    """Whether C is that of the noise; otherwise M = W' W."""

    @abstractmethod
    def value(self, M: Array) -> Array:
        """Return its value, shape (...), infinite where M is singular."""

    @abstractmethod
    def slope(self, M: Array) -> Array:
        """Return its derivative Q by M, shape (p, p), symmetric: a change dM adds tr(Q dM)."""


@dataclass(frozen=True)
class Determinant(AbstractCriterion):
    """D-optimality, -ln det(M) / 2p: the mean of ln sigma but for correlations; units only add a constant."""

    def value(self, M: Array) -> Array:
        """Return -ln det(M) / 2p."""
        sign, log = np.linalg.slogdet(M)
        return np.where(sign > 0, -log / (2 * M.shape[-1]), np.inf)

    def slope(self, M: Array) -> Array:
        """Return -M^-1 / 2p."""
        return -np.linalg.inv(M) / (2 * len(M))


@dataclass(frozen=True)
class LogSigma(AbstractCriterion):
    """Weighted mean of ln sigma_i: what the table of sigmas shows."""

    weights: tuple[float, ...]
    """One for each parameter, with sum 1."""

    def value(self, M: Array) -> Array:
        """Return sum of weights ln(sigma)."""
        return np.asarray(np.sum(np.log(sigmas_of(M)) * self.weights, axis=-1))

    def slope(self, M: Array) -> Array:
        """Return -V diag(weights / 2 V_ii) V."""
        V = np.linalg.inv(M)
        return -(V * (np.array(self.weights) / (2 * np.diag(V)))) @ V


@dataclass(frozen=True)
class Condition(AbstractCriterion):
    """ln Cond(W), of W as it is: what most of the field minimises; it depends on units, and not on the noise."""

    noise: ClassVar[bool] = False

    def value(self, M: Array) -> Array:
        """Return ln(s_max / s_min)."""
        low, high = _ends(M)
        return np.log(high / low) / 2

    def slope(self, M: Array) -> Array:
        """Return its slope, from the vectors of the largest and the smallest singular value."""
        values, vectors = np.linalg.eigh(M)
        return (_square(vectors[:, -1]) / values[-1] - _square(vectors[:, 0]) / values[0]) / 2


@dataclass(frozen=True)
class ConditionAndSmallest(AbstractCriterion):
    """ln(Cond(W' W) + 100 / s_min), of W as it is: that of the benchmark BIRDy."""

    noise: ClassVar[bool] = False

    def value(self, M: Array) -> Array:
        """Return ln(s_max^2 / s_min^2 + 100 / s_min)."""
        low, high = _ends(M)
        return np.log(high / low + 100 / np.sqrt(low))

    def slope(self, M: Array) -> Array:
        """Return its slope."""
        values, vectors = np.linalg.eigh(M)
        low, high = values[0], values[-1]
        by_low = -high / low**2 - 50 / low**1.5
        return (_square(vectors[:, -1]) / low + by_low * _square(vectors[:, 0])) / (high / low + 100 / np.sqrt(low))


@dataclass(frozen=True)
class Smallest(AbstractCriterion):
    """-ln s_min, of W as it is (E-optimality)."""

    noise: ClassVar[bool] = False

    def value(self, M: Array) -> Array:
        """Return -ln s_min."""
        return -np.log(_ends(M)[0]) / 2

    def slope(self, M: Array) -> Array:
        """Return its slope."""
        values, vectors = np.linalg.eigh(M)
        return -_square(vectors[:, 0]) / (2 * values[0])


CRITERIA: Mapping[str, AbstractCriterion] = {
    "determinant": Determinant(),
    "condition": Condition(),
    "birdy": ConditionAndSmallest(),
    "smallest": Smallest(),
}
"""Criteria that need to know of no parameter; all but the first are those of others, to compare with."""


def _ends(M: Array) -> tuple[Array, Array]:
    """Return the smallest and the largest eigenvalue, the smallest above 0."""
    values: Array = np.asarray(np.linalg.eigvalsh(M))
    return np.asarray(np.maximum(values[..., 0], TINY)), values[..., -1]


def _square(v: Array) -> Array:
    return np.outer(v, v)


def sigmas_of(M: Array) -> Array:
    """Return standard deviations, shape (..., p), of information, shape (..., p, p); infinite where it tells nothing."""
    size = np.sqrt(np.maximum(np.diagonal(M, axis1=-2, axis2=-1), TINY))  # units must not matter
    values, vectors = np.linalg.eigh(M / size[..., :, None] / size[..., None, :])
    told = values > SINGULAR * values[..., -1:]
    variance = np.sum(np.where(told, 1 / np.where(told, values, 1.0), 0.0)[..., None, :] * vectors**2, axis=-1)
    hidden = np.sum(np.where(told, 0.0, 1.0)[..., None, :] * vectors**2, axis=-1) > HIDDEN
    return np.where(hidden, np.inf, np.sqrt(variance) / size)
