"""How late a torque is, where that is large beside what is linear in it."""

from dataclasses import replace

import numpy as np

from idbench.identify.data.motion_log import MotionLog
from idbench.identify.estimators.problem import Problem
from idbench.identify.rows.factors import CONVERGED

ROUNDS = 4
"""Steps, each of which leaves a tenth of a lateness of two rows."""


def torque_lateness(problem: Problem, j: int, late: float) -> float:
    """Return how late the torque of a joint is [s], from about where it is.

        late(k+1) = late(k) + s'e / s's,   s = dY/d(delay of the joint), e = Y, both beside W, at late(k)

    Parameters
    ----------
    problem : Problem
        The explicit model, whose rows are kept.
    j : int
        The joint, from 0.
    late : float
        Lateness to first order [s].
    """
    for _ in range(ROUNDS):
        moved = problem.with_logs([_earlier(log, j, late) for log in problem.logs])
        rows = moved.rows
        weight = np.tile(moved.factors.fit(CONVERGED).weight, len(rows.time) // rows.kinds) * rows.valid
        slope = np.concatenate([part.delay_slopes(each=True)[j] for part in moved.parts]) * weight
        Q = np.linalg.qr(rows.W * weight[:, None])[0]
        left, e = (x - Q @ (Q.T @ x) for x in (slope, rows.Y * weight))
        late += float(left @ e) / float(left @ left)
    return late


def _earlier(log: MotionLog, j: int, late: float) -> MotionLog:
    """Return a log whose torque of a joint is read as so late."""
    lags = np.array(log.torque.lags or np.zeros(log.n))
    lags[j] -= late
    return replace(log, torque=replace(log.torque, lags=tuple(lags.tolist())))
