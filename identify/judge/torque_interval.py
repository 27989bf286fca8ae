"""Intervals for torques: how far predictions of a log that was not fitted are off, from predictions of stretches left out."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from idbench.identify.arrays import TINY, Array
from idbench.identify.estimators.estimate import Estimate
from idbench.identify.estimators.log_rows import LogRows
from idbench.identify.estimators.problem import Problem
from idbench.identify.signals.signals import Signals

LEVEL = 0.95
"""Share of torques that intervals shall contain."""

BLOCK = 2.0
"""Length of a block [s]: residuals of real robots are correlated over 0.2 to 3 s."""

MIN_LOGS = 3
"""Logs from which on each of them is left out, in the place of blocks."""

MOST = 0.99
"""Quantile of speeds and torques of the fit beyond which a motion is outside of what was fitted: one of a hundred samples of
the fit itself is, and single peaks of noise do not widen it."""

BEYOND = 3
"""Blocks, beyond the last of an estimate's rows, that rows of the explicit model may reach: rows of windows or of one equation
a sample end earlier, by less than a window."""

LITTLE = 0.5
"""Share of a row that the mask must leave for its error to count."""


@final
@dataclass(frozen=True, eq=False)
class TorqueInterval:
    """Half widths of intervals of the torques, in the band of the rows; all arrays have the shape (joint,)."""

    half: Array
    """Half width [N m]; NaN where a joint has no rows."""
    left_out: str
    """What was left out one by one: blocks or logs."""
    speed: Array
    """Quantile of |qd| in the fit [rad/s]."""
    torque: Array
    """Quantile of |tau| in the fit [N m]."""

    def outside(self, signals: Signals) -> float:
        """Return the share of instants at which a joint is faster, or has a larger torque, than in 99 % of the fit."""
        fast = np.abs(signals.state.qd) > self.speed[:, None]
        return float((fast | (np.abs(signals.torque.mean) > self.torque[:, None])).any(axis=0).mean())

    def contained(self, held_out: Problem, X: Array) -> tuple[Array, float]:
        """Return the share of a log's torques within the intervals of predictions by X, and that of the log outside the fit.

        The first has the shape (joint,); it is NaN where a joint has no rows. The second is `outside`, of the fit itself some
        1 % for each joint's speeds and torques.
        """
        part = held_out.explicit.parts[0]
        each = zip(_errors(part, X), self.half, strict=True)
        inside = np.array([np.mean(error <= half) if len(error) else np.nan for error, half in each])
        return inside, self.outside(part.signals)


def torque_interval(estimate: Estimate, level: float = LEVEL) -> TorqueInterval | None:
    """Return the intervals of an estimate of one run by block conformal prediction; None where rows are not kept.

    Every block of `BLOCK` seconds, or every log where there are `MIN_LOGS`, is predicted by the estimate of the others,

        X_b = (A - A_b)^-1 (c - c_b),   A_b = W_b' W_b,   c_b = W_b' Y_b   of rows made independent.

    With h_j the quantile of the absolute errors of joint j in all blocks (V. Vovk, A. Gammerman and G. Shafer, "Algorithmic
    Learning in a Random World", Springer 2005; of blocks, since neighbouring rows are alike: V. Chernozhukov, K. Wuthrich and
    Y. Zhu, "Exact and robust conformal inference methods for predictive machine learning with dependent data", COLT 2018), its
    half width is sqrt(h_j^2 + mean of W C W'): what all blocks of a log have in common, none of them shows. (UR10e, 5 pairs of
    fits and logs of like speeds: 92 to 97 % of the torques; h_j alone 89 to 97 %.)

    Of an estimator that does not solve rows, the errors are its residuals.

    Parameters
    ----------
    estimate : Estimate
        Of one run.
    level : float
        Share of torques that the intervals shall contain, between 0 and 1.
    """
    problem = estimate.problem
    if problem.long or estimate.X.ndim > 1:
        return None
    parts, explicit = problem.parts, problem.explicit.parts
    factors = problem.explicit.factors
    several = len(parts) >= MIN_LOGS
    left = _left_out(estimate, parts, several)
    errors = [_errors(part, estimate.X if left is None else left[k][_blocks(part, several)]) for k, part in enumerate(explicit)]
    independent = np.inf if estimate.model_error is None else float(estimate.model_error.independent) / parts[0].rows.kinds
    level = min(1.0, level * (1 + 1 / max(independent, 1.0)))
    each = (np.concatenate([error[j] for error in errors]) for j in range(explicit[0].rows.kinds))
    quantile = np.array([np.quantile(error, level) if len(error) else np.nan for error in each])
    W = factors.R[..., :-1]
    common = np.sum(W @ estimate.within_covariance * W, axis=(-2, -1)) / np.maximum(factors.rows, 1)
    signals = [part.signals for part in explicit]
    speed, torque = _most([each.state.qd for each in signals]), _most([each.torque.mean for each in signals])
    return TorqueInterval(np.sqrt(quantile**2 + common), "logs" if several else "blocks", speed, torque)


def _most(each: Sequence[Array]) -> Array:
    return np.asarray(np.quantile(np.abs(np.concatenate(each, axis=-1)), MOST, axis=-1))


def _errors(part: LogRows, X: Array) -> list[Array]:
    """Return the absolute errors of the rows of each joint, as large as if nothing were masked."""
    rows, error = part.rows, np.abs(part.rows.Y - np.sum(part.rows.W * X, axis=-1))
    left, kept = rows.by_kind(error), rows.maps[0].outside > LITTLE
    return [left[j, kept[j]] / rows.maps[0].outside[j, kept[j]] for j in range(rows.kinds)]


def _blocks(part: LogRows, several: bool) -> Array:
    """Return the number of the block of every row, by the time of the log."""
    time = part.rows.time
    return np.zeros(len(time), dtype=np.intp) if several else (time / BLOCK).astype(np.intp)


def _left_out(estimate: Estimate, parts: Sequence[LogRows], several: bool) -> list[Array] | None:
    """Return the estimates without each block of each part, shape (block, p)."""
    if estimate.solution is None or (white := estimate.solution.independent(parts)) is None:
        return None
    grams = list[Array]()
    for part, rows in zip(parts, white, strict=True):
        block = _blocks(part, several)
        starts = np.searchsorted(block, np.arange(1, BEYOND + int(block[-1])))
        grams.append(np.stack([x.T @ x for x in np.split(rows, starts)]))
    every = np.sum([gram.sum(axis=0) for gram in grams], axis=0)
    if (known := estimate.solution.known) is not None:
        every = every + known.T @ known
    size = np.sqrt(np.maximum(np.diagonal(every)[:-1], TINY))
    found = list[Array]()
    for gram in grams:
        A = (every - gram)[:, :-1, :-1] / np.outer(size, size)
        c = (every - gram)[:, :-1, -1:] / size[:, None]
        try:
            found.append((np.linalg.pinv(A, hermitian=True) @ c)[..., 0] / size)
        except np.linalg.LinAlgError:  # a fit is not lost because its intervals are: they are those of its residuals then
            return None
    return found
