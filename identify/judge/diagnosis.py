"""What is wrong with a fit: large mistakes and small ones; and which torques were not logged."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import scipy

from idbench.identify.arrays import TINY, Array
from idbench.identify.basis.block import Kind
from idbench.identify.data.jumps import dropouts, jumps
from idbench.identify.data.motion_log import MotionLog, never_logged
from idbench.identify.estimators.problem import Problem
from idbench.identify.judge.ripples import fast_ripples
from idbench.identify.judge.small_mistakes import CERTAIN, PROOF, small_mistakes
from idbench.identify.judge.stretches import variance_of_sums
from idbench.identify.judge.suspect import Suspect
from idbench.identify.judge.torque_gains import DECISIVE, mean_inertias
from idbench.identify.judge.whole_mistakes import turned_position, whole_mistakes

BALANCED, KNOWN = 0.1, 4.0
"""Share of its terms that a joint without a drive has as residual at most: what balances, balances to its noise; and sigma of
parameters that count for that: those of a joint whose torque was not logged vanish."""

DRIVING: tuple[Kind, ...] = ("viscous friction", "Coulomb friction")
"""Kinds of friction that are both negative where a torque has the other sign; one may be by a wrong delay."""

UNRELATED = 0.8  # Share of a torque's squares that parameters of its own leave, from which on it does not follow the motion
SMOOTH = 0.5  # Correlation of a torque from row to row from which on it follows some motion: that of noise is 0.2
ENOUGH = 4  # Rows a parameter from which on a torque is asked whether it follows the motion
MOVES = 100.0  # Standard deviations of the noise of a position beyond which a joint moves, and does not flicker by a count
DROPOUTS = 5  # Instants at which a log jumps from which on samples are missing: an encoder slips once
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
        whole[0] = replace(whole[0], sigma=small[0].sigma, explained=small[0].explained)
    elif whole and not whole[0].gains:
        return tuple(whole)
    mended = problem.explicit
    if whole and whole[0].gains:  # the residuals show others once these are right
        mended = mended.with_logs([replace(log, tau=log.tau * np.array(whole[0].gains[0])) for log in problem.logs])
        X = mended.factors.fit(2).X
        small = small_mistakes(mended, X)
    there = {(each.cause, each.joint) for each in whole}
    found = [*whole, *(each for each in small if (each.cause, each.joint) not in there)]
    waves = {(each.setting, each.joint) for each in small}
    found += [each for each in fast_ripples(mended, X, CERTAIN, PROOF) if (each.setting, each.joint) not in waves]
    # Of a joint that something else is wrong with, friction may be negative, too.
    doubted = {each.joint for each in found}
    return (*(sign for sign in _impossible_signs(mended, X) if sign.joint not in doubted), *found)


def _impossible_signs(problem: Problem, X: Array) -> Iterator[Suspect]:
    """Yield joints whose friction would drive them, or whose inertia M_jj would be negative: a sign of theirs is wrong.

    Where others feel little of a joint, all of its parameters change their sign with its torque, and residuals do not show it;
    that of the position, or both, are the alternatives, or first where they explain more. Poses at rest show neither.
    """
    if any(log.poses for log in problem.logs):
        return
    factor = problem.factors.fit(2).factor
    C = factor.inverse(np.array(factor.determined))
    # Standard deviations of residuals as correlated as they are: what is wrong elsewhere is no white noise.
    rows, to_rows = problem.rows, problem.rows.maps[0]
    left = rows.by_kind((rows.Y - rows.predicted(X)) * rows.valid)
    wider = np.sqrt(variance_of_sums(left, to_rows.grid.step / to_rows.signals.fs))
    sigma, inertias = np.sqrt(np.diagonal(C)), mean_inertias(problem, X, C) / wider
    absent = never_logged(problem.logs)
    of_kind = {(p.kind, p.joint): k for k, p in enumerate(problem.basis.parameters)}
    for j in range(problem.basis.n):
        places = [of_kind.get((kind, j)) for kind in DRIVING]
        t = [0.0 if k is None else float(X[k] / max(wider[j] * sigma[k], TINY)) for k in places]
        # A wrong delay takes its share of friction from an inertia, but leaves the friction positive.
        friction, worst = max(t), min(max(t), float(inertias[j]))
        if j not in absent and worst < -KNOWN and friction < KNOWN:
            yield _sign(problem, j, worst)


def _sign(problem: Problem, j: int, t: float) -> Suspect:
    """The wrong sign of a joint: of its torque, or of its position where the rows are likelier with that turned."""
    before, after = float(problem.factors.misfit()), float(turned_position(problem, j).factors.misfit(problem.factors.rows))
    of, other = ("position", "torque") if before - after > DECISIVE else ("torque", "position")
    gains = tuple(np.where(np.arange(problem.basis.n) == j, -1.0, 1.0).tolist())
    p, others = float(scipy.special.ndtr(t)), () if of == "position" else ((f"sign of the {other}", j),)
    found = Suspect("sign", of, j, (-1.0,), (0.0,), "1", p, -t, others, (0.0, 0.0), 0.0)
    return replace(found, gains=(gains,)) if of == "torque" else found


def _thinned(problem: Problem) -> Problem:
    """Return the problem of fewer samples, where there are many for the band of its rows: they show signs as well."""
    cutoff = problem.own_chain.cutoff
    steps = [max(1, int(log.fs / (SAMPLES * cutoff))) if cutoff else 1 for log in problem.logs]
    return problem if max(steps) == 1 else problem.with_logs(list(map(_with_fewer, problem.logs, steps)))


def _with_fewer(log: MotionLog, every: int) -> MotionLog:
    torque = replace(log.torque, period=log.torque.period or 1 / log.fs)
    conditions = {name: x[..., ::every, :] for name, x in log.conditions.items()}
    q, tau = (x[..., ::every, :] for x in (log.q, log.tau))
    return replace(log, fs=log.fs / every, q=q, tau=tau, torque=torque, conditions=conditions)


def dropped_samples(logs: Sequence[MotionLog]) -> Suspect | None:
    """Samples that were dropped, held or repeated, in the first log that jumps `DROPOUTS` times; None if none does."""
    for k, log in enumerate(logs):
        every = jumps(log.q, log.fs) if log.q.ndim == 2 and not log.poses else []
        if dropouts(every) >= DROPOUTS:
            size, first = float(dropouts(every)), min(jump.sample for jump in every if not jump.back)
            found = Suspect("dropouts", "log", None, (size,), (0.0,), "jumps", 0.0, np.inf, (), (0.0, 0.0), np.inf)
            return replace(found, instant=first / log.fs, log=k if len(logs) > 1 else None)
    return None


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
    """Joints that move in a log in which their torque never changes."""
    return sorted({j for log, own in zip(problem.logs, _moves(problem), strict=True) for j in log.unchanging if own[j]})


def _moves(problem: Problem) -> list[Array]:
    """Whether each joint moves, log by log, shape (joint,)."""
    least = MOVES * problem.position_noise
    return [np.max(np.ptp(log.q, axis=-2) > least, axis=tuple(range(log.q.ndim - 2))) for log in problem.logs]


def unrelated_joint(problem: Problem) -> int | None:
    """The first moving joint whose torque even parameters of its own hardly explain, as of noise; None if there is none."""
    factors, moves = problem.factors, np.all(_moves(problem), axis=0) & (not problem.logs[0].poses)
    every = problem.rows.by_kind(problem.rows.Y * problem.rows.valid)
    for j in np.setdiff1d(np.flatnonzero(moves), never_logged(problem.logs)):
        W, Y, y = factors.R[j, :, :-1], factors.R[j, :, -1], every[j]
        if factors.rows[j] <= ENOUGH * len(problem.names) or y[1:] @ y[:-1] > SMOOTH * (y @ y):
            continue
        if np.sum((Y - W @ np.linalg.lstsq(W, Y)[0]) ** 2) > UNRELATED * np.sum(Y**2):
            return int(j)
    return None
