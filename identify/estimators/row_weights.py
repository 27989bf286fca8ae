"""What rows whose noise differs are divided by in weighted least squares."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from weakref import WeakKeyDictionary

import numpy as np

from identify.arrays import Array
from identify.rows.factors import Factors
from identify.rows.linearization import Linearization
from identify.rows.noise_propagation import NoiseLevels, position_variance, torque_variance
from identify.rows.row_map import RowMap, in_order
from identify.rows.rows import Rows
from identify.signals.signals import Signals

LEAST, MOST = 0.01, 10.0
"""Range of b/a: residuals of some hundred rows do not show less, and more is as good as equal weights."""

ROUNDS = 10


@dataclass(frozen=True, eq=False)
class RowWeights:
    """Weights of the rows of a model that multiplies torques by something that varies, such as the power model.

    Parameters
    ----------
    parts : tuple of Rows
        Rows of each log, or of some pieces.
    noise : NoiseLevels
        That of the logs.
    linear : callable
        Returns the explicit model's linearization about signals.
    """

    parts: tuple[Rows, ...]
    noise: NoiseLevels
    linear: Callable[[Signals], Linearization]
    _variances: WeakKeyDictionary[RowMap, Array] = field(default_factory=WeakKeyDictionary, repr=False)

    def of(self, rows: Rows) -> Array:
        """Return what rows are multiplied by, shape (..., r)."""
        return reciprocal_root(self.variance(rows), self.floor)

    def variance(self, rows: Rows) -> Array:
        """Return the variance that the noise of the logs would give rows without a mask, shape (..., r)."""
        for part in rows.maps:
            if part not in self._variances:
                self._variances[part] = self._variance(part.unmasked())
        return np.concatenate([self._variances[part] for part in rows.maps], axis=-1)

    @cached_property
    def floor(self) -> Array:
        """Variance that is added to that of every row, since not all residuals are noise, shape (...): see `floor_of`."""
        variances = [self.variance(part) for part in self.parts]
        every = np.concatenate(variances, axis=-1)
        weights = [reciprocal_root(one, np.mean(every, axis=-1)) for one in variances]
        X = Factors.merged([part.factors_of(weight) for part, weight in zip(self.parts, weights, strict=True)]).fit().X
        squares = [(part.Y - part.predicted(X)) ** 2 for part in self.parts]
        return floor_of(np.concatenate(squares, axis=-1), every)

    def excess(self, X: Array, weights: Callable[[Rows], Array], free: Array) -> Array:
        """Return how many times the squares of weighted residuals are what noise makes of them, at least 1, shape (...).

        Of the estimate X, `free` the share of the residuals that its parameters do not take.
        """
        squares, expected = np.zeros(()), np.zeros(())
        for part in self.parts:
            weight = weights(part) ** 2 * part.valid
            squares = squares + np.sum(weight * (part.Y - part.predicted(X)) ** 2, axis=-1)
            expected = expected + np.sum(weight * self.variance(part), axis=-1)
        ratio = np.divide(squares, expected * free, out=np.ones_like(squares), where=expected > 0)
        return np.maximum(ratio, 1.0)

    def _variance(self, rows: RowMap) -> Array:
        linear = self.linear(rows.signals)
        return in_order(torque_variance(rows, self.noise.torque) + position_variance(rows, self.noise.position, linear))


def floor_of(squares: Array, variance: Array) -> Array:
    """Return m b/a of the variances a v + b m that explain squared residuals best, m the mean of v, shape (...).

    v is what the noise of torques and positions makes of a row. What no noise is, such as cogging, or friction of another kind
    near standstill, does not vanish where v does: with weights of v alone the slow rows of the power model, in which it is most
    of the torque, would count most. a and b, not negative, are fitted with errors in proportion to the variances themselves.

    Parameters
    ----------
    squares : Array, shape (..., r)
        Squared residuals.
    variance : Array, shape (..., r)
        v.
    """
    mean = np.mean(variance, axis=-1, keepdims=True)
    u = np.divide(variance, mean, out=np.ones_like(variance), where=mean > 0)
    a = b = np.mean(squares, axis=-1, keepdims=True) / 2
    for _ in range(ROUNDS):
        size = np.maximum(a * u + b, 1e-12 * (a + b) + 1e-300)
        ones, ramp, y = 1 / size, u / size, squares / size
        a, b = _not_negative(ramp, ones, y)
    share = np.divide(b, a, out=np.full(a.shape, MOST), where=a > 0)[..., 0]
    return mean[..., 0] * np.clip(np.where(np.isfinite(share), share, 1.0), LEAST, MOST)


def _not_negative(x: Array, z: Array, y: Array) -> tuple[Array, Array]:
    """Return a and b, not negative, of the least squares a x + b z = y along the last axis, which they keep with length 1."""
    xx, xz, zz, xy, zy = (np.sum(p * q, axis=-1, keepdims=True) for p, q in ((x, x), (x, z), (z, z), (x, y), (z, y)))
    determinant = xx * zz - xz**2
    regular = determinant > 1e-12 * xx * zz
    a = np.divide(xy * zz - zy * xz, determinant, out=np.zeros_like(xx), where=regular)
    b = np.divide(zy * xx - xy * xz, determinant, out=zy / zz, where=regular)
    return np.where(b < 0, xy / xx, np.maximum(a, 0.0)), np.where(a < 0, zy / zz, np.maximum(b, 0.0))


def reciprocal_root(variance: Array, floor: Array) -> Array:
    """Return 1 / sqrt(v + floor), shape (..., r), for a floor of shape (...); 1 where that is not known."""
    evened = variance + floor[..., None]
    known = np.isfinite(evened) & (evened > 0)
    return 1 / np.sqrt(np.where(known, evened, 1.0))
