"""What is wrong with a fit: large mistakes, small ones, and torques that were not logged."""

from dataclasses import replace

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.data.motion_log import MotionLog
from idbench.identify.estimators.problem import Problem
from idbench.identify.judge.small_mistakes import small_mistakes
from idbench.identify.judge.suspect import Suspect
from idbench.identify.judge.whole_mistakes import whole_mistake

BALANCED, KNOWN = 0.1, 4.0
"""Share of its terms that a joint without a drive has as residual at most: what balances, balances to its noise; and sigma of
parameters that count for that: those of a joint whose torque was not logged vanish."""

MOVES = 100.0
"""Standard deviations of the noise of a position beyond which a joint moves, and does not flicker by a count."""

SAMPLES = 20.0
"""Samples for each period of the operator's cut-off with which large mistakes are looked for."""


def diagnosed(problem: Problem, X: Array) -> tuple[Suspect, ...]:
    """Return what is wrong: a mistake that is not small, or small ones, whatever makes the rows most likely.

    Parameters
    ----------
    problem : Problem
        Of one run, whose rows are kept.
    X : Array, shape (p,)
        Its estimate.
    """
    problem.require_rows("mistakes are looked for by rows, and ")
    if (silent := _silent(problem.explicit, X)) is not None:
        return (silent,)
    small = small_mistakes(problem, X)
    whole = whole_mistake(_thinned(problem.explicit), small[0] if small else None)
    return (whole,) if whole else small


def _thinned(problem: Problem) -> Problem:
    """Return the problem of fewer samples, where there are many for the band of its rows: they show signs as well."""
    cutoff = getattr(problem.own_chain.operator, "cutoff", None)
    return problem.with_logs(
        [_with_fewer(log, max(1, int(log.fs / (SAMPLES * cutoff))) if cutoff else 1) for log in problem.logs]
    )


def _with_fewer(log: MotionLog, every: int) -> MotionLog:
    if every == 1:
        return log
    torque = replace(log.torque, period=log.torque.period or 1 / log.fs)
    conditions = {name: x[..., ::every, :] for name, x in log.conditions.items()}
    return replace(
        log, fs=log.fs / every, q=log.q[..., ::every, :], tau=log.tau[..., ::every, :], torque=torque, conditions=conditions
    )


def _silent(problem: Problem, X: Array) -> Suspect | None:
    """Return that the torque of the first joint whose torque never changes though it moves was not logged.

    A joint without a drive has none: inertia and weight balance in it, where parameters of one that has vanish.
    """
    rows, factor = problem.rows, problem.factors.fit(2).factor
    sigma = np.sqrt(np.diagonal(factor.inverse(np.array(factor.determined))))
    known = np.where(np.abs(X) > KNOWN * sigma, X, 0.0)
    still = np.all([np.ptp(log.tau, axis=-2) == 0 for log in problem.logs], axis=0)
    moves = np.any([np.ptp(log.q, axis=-2) > MOVES * problem.position_noise for log in problem.logs], axis=0)
    for j in map(int, np.flatnonzero(still & moves)):
        own = rows.group == j
        terms, left = np.sum((rows.W[own] * known) ** 2), np.sum((rows.Y - rows.predicted(X))[own] ** 2)
        if left >= BALANCED**2 * terms:
            return Suspect("missing_torque", "torque", j, (1.0,), (0.0,), "1", 0.0, np.inf, (), (100.0, 0.0), np.inf)
    return None
