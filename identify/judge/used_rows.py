"""Rows on which identified torques are used: unmasked, at 10 Hz, while joints move."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import numpy.typing as npt

from idbench.identify.arrays import Array
from idbench.identify.data.motion_log import MotionLog
from idbench.identify.errors import LogError
from idbench.identify.estimators.leave_out import Stretches, left_out
from idbench.identify.estimators.problem import Problem
from idbench.identify.models import ExplicitModel
from idbench.identify.rows.operators import FirLowPass
from idbench.identify.signals.masks import NoMask, slow_speed
from idbench.identify.signals.prefilters import NoisePrefilter

BAND = 10.0  # Frequency [Hz] up to which torques are judged: what drives and controllers of arms use of a model
OF_NYQUIST = 0.4  # Share of the Nyquist frequency above which no band goes: filters and differences need room


@dataclass(frozen=True, eq=False)
class UsedRows:
    """The explicit model's rows of one log, without a mask."""

    Y: Array
    """Torques, shape (instant, joint)."""
    W: Array
    """Columns, shape (instant, joint, p)."""
    moving: npt.NDArray[np.bool_]
    """Whether the joint moves, and its torque is logged, shape (instant, joint)."""
    time: Array
    """Of the rows [s], shape (instant,)."""
    band: float
    """Frequency up to which they go [Hz]."""

    @classmethod
    def of(cls, problem: Problem) -> list[Self]:
        """The rows of each log of a problem, of poses at rest all; none if a log is too short for this band."""
        try:
            return [cls._of_log(problem, log) for log in problem.logs]
        except LogError:
            return []

    @classmethod
    def _of_log(cls, problem: Problem, log: MotionLog) -> Self:
        chain, band = replace(problem.chain, mask=NoMask(), trim=None), min(BAND, OF_NYQUIST * log.fs / 2)
        if not log.poses:
            chain = replace(chain, prefilter=NoisePrefilter(3 * band, 0.0), operator=FirLowPass(band, band))
        signals = chain.signals(log)
        rows = chain.rows(signals, problem.basis, ExplicitModel())
        speed = np.abs(signals.state.qd)
        moving = (log.poses | (speed > slow_speed(signals.state.qd)[:, None]))[:, rows.maps[0].grid.samples].T
        moving[:, list(log.missing)] = False
        shape = (-1, rows.kinds)
        return cls(rows.Y.reshape(shape), rows.W.reshape(*shape, rows.W.shape[-1]), moving, rows.time[:: rows.kinds], band)

    def errors(self, X: Array) -> Array:
        """Torques less those predicted by X, of every instant or of all, shape (instant, joint); 0 where a joint rests."""
        return np.asarray(
            (self.Y - np.einsum("tjp,...tp->...tj", self.W, np.broadcast_to(X, self.W[:, 0].shape))) * self.moving
        )


def errors_left_out(problem: Problem, used: Sequence[UsedRows], stretches: Stretches) -> Array:
    """Sums of the absolute errors of each joint on used rows, those of each stretch predicted by a fit of the others, (joint,).

    By weighted least squares, whose weights are those of all rows.
    """
    parts = problem.explicit.parts
    weight = problem.explicit.factors.fit(2).weight
    rows = [part.rows.joined * np.tile(weight, part.rows.maps[0].grid.count)[:, None] for part in parts]
    X = left_out(stretches.products(parts, rows))
    return np.sum([np.sum(np.abs(one.errors(X[stretches.at(k, one.time)])), axis=0) for k, one in enumerate(used)], axis=0)
