"""How well parameters predict the torques of a motion that they were not fitted to."""

from dataclasses import dataclass
from math import sqrt

import numpy as np
import numpy.typing as npt
import scipy

from idbench.identify.arrays import TINY, Array
from idbench.identify.data.motion_log import MotionLog
from idbench.identify.errors import LogError
from idbench.identify.estimators.problem import Problem
from idbench.identify.judge.residuals import instants
from idbench.identify.judge.used_rows import as_judged, row_noise, shares
from idbench.identify.models import ExplicitModel
from idbench.identify.noise.propagation import torque_paths
from idbench.identify.rows.operators import AbstractOperator
from idbench.identify.rows.rows import Rows

LAGS = 10  # Rows over which residuals are compared with themselves
FAINT = 0.5  # Rows of which the mask leaves less than this share say little, and are not compared
WHITE = 0.95  # Share of white residuals that are called white

MARGIN = 1.3
"""Errors up to this multiple of what noise and sigma make are explained by them: levels of noise are known to some 20 %."""

EXCUSED = 0.02  # Share of the torque up to which sigma of the parameters excuses an error: a misfit makes sigma large, too
ROUNDING = 1e-12  # Share of the largest predicted torque below which one is rounding
HELD_OUT = 0.25  # Share of a log, at its end, that is held out where there is no second log


@dataclass(frozen=True, eq=False)
class Validation:
    """Torques measured and predicted at the rows of a chain, joint by joint; all arrays have the shape (joint,).

    Rows of which the mask takes a part count as that part of a row, so that a constant has its own size.
    """

    rms: Array
    """Of measured - predicted torque while the joint moves [N m]."""
    level: Array
    """Rms of the measured torque there; of a joint without a drive, whose torque is 0, that of what balances in it [N m]."""
    R2: Array
    """Share of the measured torque's variance that is predicted there."""
    standing: Array
    """Rms of the error where the joint rests or reverses [N m], where friction is not determined; NaN if it never does."""
    correlation: Array
    """Largest correlation of the error with itself, by size, 2 to `LAGS` rows later. (Noise of differentiated positions
    alternates from row to row: what is one row later says nothing of the model.)"""
    bound: Array
    """What the correlation of noise that was white before the operator stays below in 95 % of joints; in 90 % where a mask
    takes part of many rows."""
    rows: npt.NDArray[np.intp]
    """How many rows move."""
    noise: Array
    """Rms of the noise of these rows, from what lies above their band [N m] (`row_noise`); NaN if it does not."""
    open: Array
    """Rms of what sigma of the parameters makes of the torque there [N m]; 0 if their covariance is not given."""

    @property
    def expected(self) -> Array:
        """Rms error of the right model [N m], with these parameters' sigma, on a log as noisy as this."""
        return np.sqrt(np.nan_to_num(self.noise) ** 2 + self.open**2)

    @property
    def excess(self) -> Array:
        """Error that neither noise nor sigma explains, shape (joint,) [N m]: what the model is wrong by."""
        excused = np.minimum(self.open, EXCUSED * self.level)
        squares = MARGIN**2 * (np.nan_to_num(self.noise) ** 2 + excused**2)
        return np.sqrt(np.maximum(self.rms**2 - squares, 0.0))

    def percent_of_level(self, torque: Array) -> Array:
        """Return 100 torque / level; infinite where there is a torque and no level, 0 where there is neither."""
        none = np.where(np.isnan(torque), np.nan, np.where(torque > 0, np.inf, 0.0))
        return 100 * np.divide(torque, self.level, out=none, where=self.level > 0)

    @property
    def percent(self) -> Array:
        """100 rms / level."""
        return self.percent_of_level(self.rms)

    @property
    def white(self) -> npt.NDArray[np.bool_]:
        """Whether the error cannot be distinguished from noise."""
        return np.abs(self.correlation) <= self.bound


def validate(held_out: Problem, X: Array, covariance: Array | None = None, noise: Array | None = None) -> Validation:
    """Torque errors of the explicit model with parameters `X` and their `covariance` on a log.

    Both sides go through the same chain. Where a joint reverses or rests is judged apart, also where the chain masks nothing:
    figures of fits with and without friction are comparable. A joint that never moves counts then, all the time.

    Parameters
    ----------
    held_out : Problem
        One log, with the robot and the chain by which it is judged.
    X : Array, shape (p,)
        Parameters of its basis.
    covariance : Array, shape (p, p), optional
        Theirs.
    noise : Array, shape (joint,), optional
        Of the torques of poses at rest [N m], which do not show their noise themselves; of a motion the rms of what no function
        of it predicts in the rows of the fit, where that is more than what lies above their band: noise of low frequency.

    Raises
    ------
    LogError
        If the log holds several runs, does not fit the basis, is too short for the chain, or nothing moves. Of a joint that
        never moves figures are NaN.
    IdentificationError
        If the log is too long for its rows to be kept.
    """
    if len(held_out.logs) > 1 or held_out.logs[0].q.ndim != 2:
        raise LogError(
            f"a motion is judged by itself, not {len(held_out.logs)} of shape {held_out.logs[0].q.shape}: give them one by one"
        )
    held_out.require_rows("a motion is judged by its rows, and ")
    judged = as_judged(held_out)
    signals, rows = judged.signals[0], judged.parts[0].rows
    chain, basis = judged.chain, judged.basis
    left = instants(signals, basis, ExplicitModel(), chain, X)
    moving = [_Joint.of(rows, X, j) for j in range(basis.n)]
    rest = 1.0 - signals.weight
    rest[..., list(signals.log.missing), :] = 0.0
    standing = chain.operator.map(left.equations, left.equations.weighted_as(rest), chain.grid(signals.log))
    still = rows.by_kind(standing.measurement(left.everywhere)), shares(standing)
    squares, count_still = (np.sum(x**2, axis=-1, where=standing.outside > 0) for x in still)
    rms, level, R2, correlation, count = zip(*(joint.judged() for joint in moving), strict=True)
    if not any(count):
        raise LogError(
            "no joint moves in this log, as far as the mask of the chain sees: use another motion, or a lower --mask-speed"
        )
    bound = _bound(chain.operator, signals.fs) / np.sqrt(np.maximum(count, 1))
    given = np.full(basis.n, np.nan) if noise is None else noise
    white = given if signals.log.poses else row_noise(left, signals, chain) * [joint.unmasked for joint in moving]
    noise = np.where(np.isfinite(rms), np.fmax(white, given), np.nan)
    left_open = [joint.open(covariance) for joint in moving]
    still_rms = np.sqrt(np.divide(squares, count_still, out=np.full(basis.n, np.nan), where=count_still > 0))
    return Validation(*map(np.array, (rms, level, R2, still_rms, correlation, bound, count, noise, left_open)))


def split(log: MotionLog, share: float = HELD_OUT) -> tuple[MotionLog, MotionLog]:
    """Return the beginning of a log, and the `share` at its end that is held out."""
    cut = round((1 - share) * log.samples)
    return log.part(0, cut), log.part(cut, log.samples)


def _bound(operator: AbstractOperator, fs: float) -> float:
    """95 % bound of the autocorrelation of filtered white noise, times sqrt(N).

    It is the largest of LAGS - 1 normal ones, whose variance is the sum of squares of the rows' own correlations (Bartlett).
    """
    h, step = operator.response(fs), operator.step(fs)
    own = np.array([h[lag:] @ h[: len(h) - lag] for lag in range(0, len(h), step)]) / (h @ h)
    largest = scipy.special.ndtri((1 + WHITE ** (1 / (LAGS - 1))) / 2)
    return float(largest * np.sqrt(1 + 2 * np.sum(own[1:] ** 2)))


@dataclass(frozen=True, eq=False)
class _Joint:
    """The rows of a joint: torque, residual, W, and which are valid.

    `spread` is what white noise would have in them, `share` what the mask leaves of a constant.
    """

    y: Array
    rho: Array
    W: Array
    valid: npt.NDArray[np.bool_]
    spread: Array
    share: Array
    X: Array
    predicted: bool
    """Whether anything predicts its torque: of an upright axis at rest, no gravity does."""

    @classmethod
    def of(cls, rows: Rows, X: Array, joint: int) -> "_Joint":
        own = rows.group == joint
        spread = np.sqrt(torque_paths(rows.maps[0]).variance(np.ones(rows.kinds))[own])
        share = shares(rows.maps[0])[joint]
        # Y has the constant of laws that are linear about an estimate, too, which may be many times the torque.
        measured = rows.maps[0].measurement(rows.maps[0].signals.torque.mean)
        rho = rows.Y - rows.predicted(X)
        of_model = np.abs(measured - rho)
        some = of_model[own].max(initial=0.0) > ROUNDING * of_model.max(initial=0.0)
        predicted = bool(some) or not rows.maps[0].signals.log.poses
        return cls(measured[own], rho[own], rows.W[own], rows.valid[own], spread, share, X, predicted)

    def judged(self) -> tuple[float, float, float, float, int]:
        """Return the rms of residual and torque, R2, correlation, and the number of valid rows."""
        rho, y, share = (x[self.valid] for x in (self.rho, self.y, self.share))
        if not len(rho) or not self.predicted:
            return np.nan, np.nan, np.nan, np.nan, 0
        mean = float(share @ y) / self.rows
        spread = float(np.sum((y - mean * share) ** 2))
        R2 = 1 - float(rho @ rho) / spread if spread > 0 else np.nan
        # Of a joint whose torque is 0: that of the terms of the model, W_i X_i, as if they were independent of each other.
        level = self._rms(y) or self._rms(self.W[self.valid] * self.X)
        return self._rms(rho), level, R2, self._correlation(), len(rho)

    @property
    def rows(self) -> float:
        """How many rows there are, those of which a part is masked by their part."""
        return max(float(np.sum(self.share[self.valid] ** 2)), TINY)

    def _rms(self, x: Array) -> float:
        """Return the rms of what valid rows have, as if nothing of them were masked."""
        return sqrt(float(np.sum(x**2)) / self.rows)

    @property
    def unmasked(self) -> float:
        """The rms of rows of white noise over that of rows of which the mask takes nothing."""
        most = float(self.spread.max())
        return self._rms(self.spread[self.valid]) / most if most > 0 else np.nan

    def open(self, covariance: Array | None) -> float:
        """Return the rms over the rows of the sigma of W X."""
        W = self.W[self.valid]
        return 0.0 if covariance is None else sqrt(float(np.sum(W @ covariance * W)) / self.rows)

    def _correlation(self) -> float:
        """Return the sum of products of residuals with later ones that departs most from that of noise, as a correlation.

        Rows that the mask takes part of are smaller: each is divided by what white noise would leave of it.
        """
        valid = self.valid & (self.spread > FAINT * self.spread.max(initial=0.0))
        rho = np.divide(self.rho, self.spread, out=np.zeros(len(self.spread)), where=valid)
        rho[valid] -= rho[valid].mean()
        variance = max(float(np.mean(rho[valid] ** 2)), TINY)
        departures = [0.0]
        for lag in range(2, min(LAGS, len(rho) - 1) + 1):
            pairs = int(np.count_nonzero(valid[lag:] & valid[:-lag]))
            departures.append(float(rho[lag:] @ rho[:-lag]) / variance / sqrt(max(pairs, 1)))
        return max(departures, key=abs) / sqrt(max(int(np.count_nonzero(self.valid)), 1))
