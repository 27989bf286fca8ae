"""What rows whose noise differs are divided by in weighted least squares."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from weakref import WeakKeyDictionary

import numpy as np
import numpy.typing as npt
import scipy

from identify.arrays import Array, combined
from identify.models.model import AbstractModel
from identify.noise.linearization import smoothed
from identify.noise.propagation import NoisyRows
from identify.noise.two_levels import two_levels
from identify.rows.factors import Factors
from identify.rows.row_map import RowMap
from identify.rows.rows import Rows

LEAST, MOST = 0.01, 10.0
"""Range of b/a: residuals of some hundred rows do not show less, and more is as good as equal weights."""


@dataclass(frozen=True, eq=False)
class RowWeights:
    """Weights of the rows of a model that multiplies torques by something that varies, such as the power model.

    Parameters
    ----------
    parts : tuple of Rows
        Rows of each log, or of some pieces.
    model : AbstractModel
        Theirs.
    noise : NoisyRows
        That of the logs.
    """

    parts: tuple[Rows, ...]
    model: AbstractModel
    noise: NoisyRows
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
        valid = np.concatenate([part.valid for part in self.parts], axis=-1)
        return floor_of(np.concatenate(squares, axis=-1), every, valid)

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

    def bias(self, rows: RowMap) -> Array:
        """Return what noise of the velocities makes of W X where joints hardly move, shape (..., r).

        Friction turns noise into power, Fs |qd|, of one sign: that of a velocity of E|qd + noise| - |qd|.
        """
        signals, linear = rows.signals, self.noise.linear(rows.signals)
        speed = rectified(smoothed(signals.state.qd, signals.fs), self.noise.levels.position[..., None] * signals.gain)
        columns = self.model.c(linear.basis, replace(signals.state, qd=speed))
        return rows.measurement(combined(columns, linear.X, np.zeros(rows.inside.shape)))

    def _variance(self, rows: RowMap) -> Array:
        return self.noise.covariance(rows).variance + self.bias(rows) ** 2


def floor_of(squares: Array, variance: Array, valid: npt.NDArray[np.bool_]) -> Array:
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
    valid : bool array, shape (..., r)
        False for void rows, which say nothing.
    """
    count = np.maximum(np.sum(valid, axis=-1, keepdims=True), 1)
    mean = np.sum(variance * valid, axis=-1, keepdims=True) / count
    u = np.divide(variance, mean, out=np.ones_like(variance), where=mean > 0)
    a, b = two_levels(u * valid, np.where(valid, 1.0, 0.0), squares * valid)
    share = np.divide(b, a, out=np.full(a.shape, MOST), where=a > 0)
    return mean[..., 0] * np.clip(np.where(np.isfinite(share), share, 1.0), LEAST, MOST)


def reciprocal_root(variance: Array, floor: Array) -> Array:
    """Return 1 / sqrt(v + floor), shape (..., r), for a floor of shape (...); 1 where that is not known."""
    evened = variance + floor[..., None]
    known = np.isfinite(evened) & (evened > 0)
    return 1 / np.sqrt(np.where(known, evened, 1.0))


def rectified(x: Array, sigma: Array) -> Array:
    """Return E|x + n| - |x| for normal n of standard deviation sigma, 2 sigma (phi(u) - u Q(u)) with u = |x| / sigma."""
    known = np.isfinite(sigma) & (sigma > 0)
    scale = np.where(known, sigma, 1.0)
    u = np.abs(x) / scale
    density = np.exp(-(u**2) / 2) / np.sqrt(2 * np.pi)
    return np.where(known, 2 * scale * (density - u * scipy.special.ndtr(-u)), 0.0)
