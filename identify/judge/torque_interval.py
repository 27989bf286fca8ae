"""Intervals for torques: how far predictions of a log that was not fitted are off, from predictions of stretches left out."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.estimators.estimate import Estimate
from idbench.identify.estimators.leave_out import Stretches
from idbench.identify.estimators.problem import Problem
from idbench.identify.judge.used_rows import UsedRows
from idbench.identify.signals.signals import Signals

LEVEL = 0.95  # Share of torques that intervals shall contain

OTHER_MOTION = 1.3
"""How much larger errors are on another motion than on stretches left out of the fitted one. No theorem: on 24 pairs of real
logs of eight robots intervals then hold 94 % of the torques where the motion is within the fitted speeds, without it 89 %."""

MOST = 0.99
"""Quantile of speeds and torques of the fit beyond which a motion is outside of what was fitted: one of a hundred samples of
the fit itself is, and single peaks of noise do not widen it."""


@dataclass(frozen=True, eq=False)
class TorqueInterval:
    """Half widths of intervals of the torques of moving joints; all arrays have the shape (joint,)."""

    half: Array
    """Half width [N m]; NaN where a joint never moves, or has no torque."""
    band: float
    """Frequency up to which torques are compared [Hz]."""
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

        The first has the shape (joint,); it is NaN where a joint does not move. The second is `outside`, of the fit itself some
        1 % for each joint's speeds and torques.
        """
        used = UsedRows.of(held_out)
        errors = _moving(used, [np.abs(one.errors(X)) for one in used]) if used else [np.empty(0)] * len(self.half)
        each = zip(errors, self.half, strict=True)
        inside = np.array([np.mean(error <= half) if len(error) else np.nan for error, half in each])
        return inside, self.outside(held_out.explicit.parts[0].signals)


def torque_interval(estimate: Estimate, level: float = LEVEL) -> TorqueInterval | None:
    """Return the intervals of an estimate of one run by block conformal prediction; None where rows are not kept, or too few.

    Every stretch is predicted by the estimate of the others (`moved`). The half width is `OTHER_MOTION` times the quantile of
    the absolute errors of the joint in all stretches (V. Vovk, A. Gammerman and G. Shafer, "Algorithmic Learning in a Random
    World", Springer 2005; of stretches, since neighbouring rows are alike: V. Chernozhukov, K. Wuthrich and Y. Zhu, "Exact and
    robust conformal inference methods for predictive machine learning with dependent data", COLT 2018). Errors are those of
    `UsedRows`: up to 10 Hz, whatever the band of the fit, and without a mask, since torques are predicted near reversals, too.

    Of an estimator of which it is not known how X follows from rows, the errors are its residuals.

    Parameters
    ----------
    estimate : Estimate
        Of one run.
    level : float
        Share of torques that the intervals shall contain, between 0 and 1.
    """
    problem = estimate.problem
    if problem.long or estimate.X.ndim > 1 or not (used := UsedRows.of(problem)):
        return None
    stretches = Stretches.of(problem.parts)
    moved = 0.0 if estimate.model_error is None else estimate.model_error.moved
    X = np.broadcast_to(estimate.X + moved, (stretches.count, len(estimate.X)))
    errors = _moving(used, [np.abs(one.errors(X[stretches.at(k, one.time)])) for k, one in enumerate(used)])
    half = np.array([OTHER_MOTION * np.quantile(error, level) if len(error) else np.nan for error in errors])
    signals = [part.signals for part in problem.explicit.parts]
    speed, torque = _most([each.state.qd for each in signals]), _most([each.torque.mean for each in signals])
    return TorqueInterval(half, min(one.band for one in used), speed, torque)


def _most(each: Sequence[Array]) -> Array:
    return np.asarray(np.quantile(np.abs(np.concatenate(each, axis=-1)), MOST, axis=-1))


def _moving(used: Sequence[UsedRows], errors: Sequence[Array]) -> list[Array]:
    """Errors of each joint while it moves, of all logs."""
    moving, every = np.concatenate([one.moving for one in used]), np.concatenate(errors)
    return [every[moving[:, j], j] for j in range(every.shape[1])]
