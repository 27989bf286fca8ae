"""How well parameters predict the torques of a motion that they were not fitted to."""

from dataclasses import dataclass, replace
from math import sqrt
from typing import final

import numpy as np
import numpy.typing as npt
import scipy

from identify.arrays import Array
from identify.basis import Basis
from identify.chain import Chain
from identify.errors import LogError
from identify.long import manageable
from identify.masks.complement import Complement
from identify.models import ExplicitModel
from identify.motion_log import MotionLog
from identify.operators import AbstractOperator
from identify.row_noise import row_noise
from identify.system import System

LAGS = 10
"""Rows over which residuals are compared with themselves."""

FAINT = 0.5
"""Rows of which the mask leaves less than this share say little, and are not compared."""

WHITE = 0.95
"""Share of white residuals that are called white."""

MARGIN = 1.3
"""Errors up to this multiple of what noise and sigma make are explained by them: levels of noise are known to some 20 %."""

EXCUSED = 0.02
"""Share of the torque up to which sigma of the parameters excuses an error: a misfit makes sigma large, too."""

HELD_OUT = 0.25
"""Share of a log, at its end, that is held out where there is no second log."""


@final
@dataclass(frozen=True, eq=False)
class Validation:
    """Torques measured and predicted at the rows of a chain, joint by joint; all arrays have the shape (joint,).

    Parameters
    ----------
    rms : Array
        Of measured - predicted torque while the joint moves [N m].
    level : Array
        Rms of the measured torque there [N m].
    R2 : Array
        Share of the measured torque's variance that is predicted there.
    standing : Array
        Rms of the error where the joint stands or turns [N m], where friction is not determined; NaN if it never does.
    correlation : Array
        Largest correlation of the error with itself, by size, 2 to `LAGS` rows later. (Noise of differentiated positions
        alternates from row to row: what is one row later says nothing of the model.)
    bound : Array
        What the correlation of noise that was white before the operator stays below in 95 % of joints; in 90 % where a mask
        takes part of many rows.
    rows : int array
        How many rows move.
    noise : Array
        Rms of the noise of these rows, as what lies above their band tells it [N m] (`row_noise`); NaN if it does not.
    open : Array
        Rms of what sigma of the parameters makes of the torque there [N m]; 0 if their covariance is not given.
    """

    rms: Array
    level: Array
    R2: Array
    standing: Array
    correlation: Array
    bound: Array
    rows: npt.NDArray[np.intp]
    noise: Array
    open: Array

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
        """Whether the error is not to be told from noise."""
        return np.abs(self.correlation) <= self.bound


def validate(log: MotionLog, basis: Basis, X: Array, chain: Chain, covariance: Array | None = None) -> Validation:
    """Return how well the parameters `X`, with their `covariance`, predict the torques of one log, by the explicit model.

    Both sides go through the same chain. What its mask leaves out is judged apart; of a long log the beginning is judged.

    Raises
    ------
    LogError
        If the log holds several runs, does not fit the basis, is too short for the chain, or a joint of it never moves.
    """
    if log.q.ndim != 2:
        raise LogError(f"a motion is judged by itself, the log has shape {log.q.shape}: give the runs one by one")
    log = manageable(log)
    moving = chain.build(log, basis, ExplicitModel())
    standing = replace(chain, mask=Complement(chain.mask)).build(log, basis, ExplicitModel())
    each = [_judge(moving, X, j) for j in range(basis.n)]
    still = [_rms(_residual(standing, X, j)[0]) for j in range(basis.n)]
    rms, level, R2, correlation, rows = zip(*each, strict=True)
    if 0 in rows:
        raise LogError(
            f"joint {rows.index(0) + 1} never moves in this log, as far as the mask of the chain sees: use a motion in which "
            "all joints do"
        )
    bound = _bound(chain.operator, log.fs) / np.sqrt(rows)
    noise = row_noise(log, basis, X, chain) * [_unmasked(moving, j) for j in range(basis.n)]
    left_open = [_sigma_rms(moving, covariance, j) for j in range(basis.n)]
    return Validation(*map(np.array, (rms, level, R2, still, correlation, bound, rows, noise, left_open)))


def split(log: MotionLog, share: float = HELD_OUT) -> tuple[MotionLog, MotionLog]:
    """Return the beginning of a log, and the `share` at its end that is held out."""
    cut = round((1 - share) * log.samples)
    return log.part(0, cut), log.part(cut, log.samples)


def _bound(operator: AbstractOperator, fs: float) -> float:
    """Return what the correlation of rows that an operator makes of white noise stays below, times the root of their number.

    It is the largest of LAGS - 1 normal ones, whose variance is the sum of squares of the rows' own correlations (Bartlett).
    """
    h, step = operator.response(fs), operator.step(fs)
    own = np.array([h[lag:] @ h[: len(h) - lag] for lag in range(0, len(h), step)]) / (h @ h)
    largest = scipy.stats.norm.ppf((1 + WHITE ** (1 / (LAGS - 1))) / 2)
    return float(largest * np.sqrt(1 + 2 * np.sum(own[1:] ** 2)))


def _residual(system: System, X: Array, joint: int) -> tuple[Array, Array]:
    """Return residual and measured torque of a joint's rows, void ones left out."""
    rows = (system.group == joint) & system.valid
    return system.Y[rows] - system.W[rows] @ X, system.Y[rows]


def _judge(system: System, X: Array, joint: int) -> tuple[float, float, float, float, int]:
    rho, y = _residual(system, X, joint)
    if not len(rho):
        return np.nan, np.nan, np.nan, np.nan, 0
    spread = float(np.sum((y - y.mean()) ** 2))
    return _rms(rho), _rms(y), 1 - float(rho @ rho) / max(spread, 1e-300), _correlation(system, X, joint), len(rho)


def _unmasked(system: System, joint: int) -> float:
    """Return the rms of a joint's rows of white noise over that of rows of which the mask takes nothing."""
    variance = np.concatenate([carrier.variance() for carrier in system.carriers], axis=-1)[system.group == joint]
    valid = system.valid[system.group == joint]
    return float(np.sqrt(variance[valid].mean() / variance.max()))


def _sigma_rms(system: System, covariance: Array | None, joint: int) -> float:
    """Return the rms over a joint's rows of the sigma of W X."""
    W = system.W[(system.group == joint) & system.valid]
    return 0.0 if covariance is None else float(np.sqrt(np.mean(np.einsum("rp,pq,rq->r", W, covariance, W, optimize=True))))


def _rms(x: Array) -> float:
    return float(np.sqrt(np.mean(x**2))) if len(x) else np.nan


def _correlation(system: System, X: Array, joint: int) -> float:
    """Return the sum of products of a joint's residuals with later ones that departs most from that of noise, as a correlation.

    Rows that the mask takes part of are smaller: each is divided by what white noise would leave of it.
    """
    rows = system.group == joint
    spread = np.sqrt(np.concatenate([carrier.variance() for carrier in system.carriers], axis=-1)[rows])
    valid = system.valid[rows] & (spread > FAINT * spread.max(initial=0.0))
    rho = np.divide(system.Y[rows] - system.W[rows] @ X, spread, out=np.zeros(len(spread)), where=valid)
    rho[valid] -= rho[valid].mean()
    variance = max(float(np.mean(rho[valid] ** 2)), 1e-300)
    departures = [0.0]
    for lag in range(2, min(LAGS, len(rho) - 1) + 1):
        pairs = int(np.count_nonzero(valid[lag:] & valid[:-lag]))
        departures.append(float(rho[lag:] @ rho[:-lag]) / variance / sqrt(max(pairs, 1)))
    return max(departures, key=abs) / sqrt(max(int(np.count_nonzero(system.valid[rows])), 1))
