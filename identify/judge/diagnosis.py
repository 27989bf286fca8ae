"""What is wrong with a fit: large mistakes and small ones; and which torques were not logged."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import scipy

from idbench.identify.arrays import TINY, Array
from idbench.identify.basis.block import Kind
from idbench.identify.data.motion_log import MotionLog, never_logged
from idbench.identify.estimators.problem import Problem
from idbench.identify.judge.small_mistakes import small_mistakes
from idbench.identify.judge.suspect import Suspect
from idbench.identify.judge.torque_gains import mean_inertias
from idbench.identify.judge.whole_mistakes import whole_mistakes

BALANCED, KNOWN = 0.1, 4.0
"""Share of its terms that a joint without a drive has as residual at most: what balances, balances to its noise; and sigma of
parameters that count for that: those of a joint whose torque was not logged vanish."""

DRIVING: tuple[Kind, ...] = ("viscous friction", "Coulomb friction")
"""Kinds of friction that are both negative where a torque has the other sign; one may be by a wrong delay."""

MOVES = 100.0  # Standard deviations of the noise of a position beyond which a joint moves, and does not flicker by a count
SAMPLES = 20.0  # Samples for each period of the operator's cut-off with which large mistakes are looked for


def diagnosed(problem: Problem, X: Array) -> tuple[Suspect, ...]:
    """Mistakes that make the rows most likely: one that is not small, or several small ones.

    Parameters
    ----------
    problem : Problem
        Of one run, whose rows are kept.
    X : Array, shape (p,)
        Its estimate.
    """
    problem.require_rows("mistakes are looked for by rows, and ")
    small = small_mistakes(problem, X)
    whole = whole_mistakes(_thinned(problem.explicit), small[0] if small else None)
    if whole and small and (whole[0].cause, whole[0].joint) == (small[0].cause, small[0].joint):
        small, whole = (whole[0], *small[1:]), []
    return tuple(whole) or (*_impossible_signs(problem.explicit, X), *small)


def _impossible_signs(problem: Problem, X: Array) -> Iterator[Suspect]:
    """Yield joints whose friction would drive them, or whose inertia M_jj would be negative: their torque has the other sign.

    Where others feel little of a joint, all of its parameters change their sign with its torque, and residuals do not show it.
    Poses at rest show neither.
    """
    if any(log.poses for log in problem.logs):
        return
    factor = problem.factors.fit(2).factor
    C = factor.inverse(np.array(factor.determined))
    sigma, inertias = np.sqrt(np.diagonal(C)), mean_inertias(problem, X, C)
    absent = never_logged(problem.logs)
    of_kind = {(p.kind, p.joint): k for k, p in enumerate(problem.basis.parameters)}
    for j in range(problem.basis.n):
        places = [of_kind.get((kind, j)) for kind in DRIVING]
        t = [0.0 if k is None else float(X[k] / max(sigma[k], TINY)) for k in places]
        # A wrong delay takes its share of friction from an inertia, but leaves the friction positive.
        friction, worst = max(t), min(max(t), float(inertias[j]))
        if j not in absent and worst < -KNOWN and friction < KNOWN:
            p = float(scipy.special.ndtr(worst))
            yield Suspect("sign", "torque", j, (-1.0,), (0.0,), "1", p, -worst, (), (0.0, 0.0), 0.0)


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


def silent_joint(problem: Problem, X: Array) -> Suspect | None:
    """The missing torque of the first moving joint whose torque column is constant; None if there is none.

    A joint without a drive has none: inertia and weight balance in it, where parameters of one that has vanish.

    Parameters
    ----------
    problem : Problem
        The explicit model of one run, whose rows are kept.
    X : Array, shape (p,)
        Its estimate.
    """
    if not (still := still_joints(problem)):
        return None
    factor = problem.factors.fit(2).factor
    sigma = np.sqrt(np.diagonal(factor.inverse(np.array(factor.determined))))
    known = np.where(np.abs(X) > KNOWN * sigma, X, 0.0)
    for j in still:
        terms, left = 0.0, 0.0
        for log, part in zip(problem.logs, problem.parts, strict=True):
            if j in log.unchanging:
                rows = part.rows
                own = rows.group == j
                terms += np.sum((rows.W[own] * known) ** 2)
                left += np.sum((rows.Y - rows.predicted(X))[own] ** 2)
        if left >= BALANCED**2 * terms:
            return unlogged(j)
    return None


def unlogged(j: int) -> Suspect:
    """The mistake of a joint whose torque was not logged."""
    return Suspect("missing_torque", "torque", j, (1.0,), (0.0,), "1", 0.0, np.inf, (), (100.0, 0.0), np.inf)


def still_joints(problem: Problem) -> list[int]:
    """Return the joints that move in a log in which their torque never changes."""
    least = MOVES * problem.position_noise
    moves = [np.max(np.ptp(log.q, axis=-2) > least, axis=tuple(range(log.q.ndim - 2))) for log in problem.logs]
    return sorted({j for log, own in zip(problem.logs, moves, strict=True) for j in log.unchanging if own[j]})
