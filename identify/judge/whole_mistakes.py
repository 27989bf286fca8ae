"""Mistakes that are not small: signs, exchanged torques, gravity that points elsewhere, torques that were not logged."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import numpy.typing as npt

from idbench.identify.arrays import TINY, Array
from idbench.identify.basis.tree_links import TreeLinks
from idbench.identify.data.motion_log import MotionLog
from idbench.identify.estimators.problem import Problem
from idbench.identify.judge.stretches import held_out_errors
from idbench.identify.judge.suspects import Suspect, suspects
from idbench.identify.rows.factors import Factors

POOR = 5.0
"""Residuals [% of a joint's torque] above which more is tried than signs of torques: a wrong axis leaves tens."""

DECISIVE = 40.0
"""What a mistake takes of minus twice the logarithm of the likelihood at least: with rows that are correlated over ten of their
steps, four sigma of independent ones."""

RATES = (0.8, 0.9, 0.95, 1.05, 1.1, 1.25)
"""Rates of the clock, over the stated one, that are tried where something is wrong."""

BALANCED, KNOWN = 0.1, 4.0
"""Share of its terms that a joint without a drive has as residual at most: what balances, balances to its noise; and sigma of
parameters that count for that: those of a joint whose torque was not logged vanish."""

MOVES = 100.0
"""Standard deviations of the noise of a position beyond which a joint moves, and does not flicker by a count."""

SAMPLES = 20.0
"""Samples for each period of the operator's cut-off with which large mistakes are looked for."""

MOST = 3
"""Large mistakes that are tried on held-out stretches, the most likely first."""

NOTHING_LEFT = 1 / 3
"""Share of the largest error that the right sign or axis leaves at most: a wrong one also explains a part of other mistakes."""

ALMOST_NONE = 1e-3
"""Share of gravity in torques that are without it: so little that parameters stay apart."""


@dataclass(frozen=True)
class _Tried:
    cause: str
    of: str
    joint: int | None
    size: tuple[float, ...]
    problem: Problem
    """The problem as it would be without the mistake."""


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
    small = suspects(problem, X)
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


def whole_mistake(problem: Problem, small: Suspect | None = None) -> Suspect | None:
    """Return the mistake without which the rows are by far most likely, by more than a `small` one; None where none is."""
    explicit = problem.explicit
    before, counts = _unlikely(explicit.factors), explicit.factors.rows
    tried = [*_signs(explicit), *(_rates(explicit) if small else ())]
    if _worst(explicit) > POOR:
        tried += [*_exchanged(explicit), *_gravities(explicit), *_turned(explicit)]
    gains = [before - _unlikely(each.problem.with_logs(each.problem.logs).factors, counts) for each in tried]  # kept by none
    found = sorted(zip(gains, tried, strict=True), key=lambda one: -one[0])
    before_errors = held_out_errors(explicit)
    for gain, best in found[:MOST]:
        if gain < max(DECISIVE, small.gain if small else 0.0):
            break
        errors = held_out_errors(best.problem)
        k = int(np.argmax(np.log(before_errors) - np.log(errors)))
        if errors[k] > min(NOTHING_LEFT * before_errors[k], small.held_out[1] if small else np.inf):
            continue
        near = [(each.cause, each.joint) for other, each in found if other > 0.9 * gain and each is not best]
        others = tuple(key for key in dict.fromkeys(near) if key != (best.cause, best.joint))
        pair, unit = (float(before_errors[k]), float(errors[k])), "rad" if best.cause == "zero" else "1"
        return Suspect(best.cause, best.of, best.joint, best.size, (0.0,), unit, 0.0, float(np.sqrt(gain)), others, pair, gain)
    return None


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


def _unlikely(factors: Factors, counts: npt.NDArray[np.intp] | None = None) -> float:
    """Return minus twice the logarithm of the likelihood, with a level of noise of each kind, as of so many rows."""
    X, rows = factors.fit(2).X, np.maximum(factors.rows, 1)
    if not np.isfinite(X).all():
        return np.inf
    return float(np.sum((rows if counts is None else counts) * np.log(np.maximum(factors.squares(X) / rows, TINY))))


def _worst(problem: Problem) -> float:
    """Return the largest residual of a joint [% of its torque]."""
    factors = problem.factors
    whole = np.sum(factors.R[..., -1] ** 2, axis=-1)
    share = np.divide(factors.squares(factors.fit(2).X), whole, out=np.zeros(whole.shape), where=whole > 0)
    return float(100 * np.sqrt(np.max(share)))


def _changed(problem: Problem, q: Array | None = None, tau: Array | None = None) -> Problem:
    """Return the problem with positions and torques multiplied by a matrix, joint by joint."""
    logs = [
        replace(log, q=log.q if q is None else log.q @ q, tau=log.tau if tau is None else log.tau @ tau) for log in problem.logs
    ]
    return problem.with_logs(logs)


def _signs(problem: Problem) -> Iterator[_Tried]:
    """Yield the torque of each joint with the other sign: of the factors alone the last column changes."""
    n, factors = problem.basis.n, problem.factors
    held = bool(problem.basis.held)  # whose torque keeps its sign
    for j in range(n):
        R = factors.R.copy()
        R[j, :, -1] *= -1
        flipped = replace(factors, R=R, _fits=[])
        if held or _unlikely(flipped) < _unlikely(factors) - DECISIVE:
            yield _Tried("sign", "torque", j, (-1.0,), _changed(problem, tau=_diagonal(n, j)))


def _diagonal(n: int, j: int) -> Array:
    return np.diag(np.where(np.arange(n) == j, -1.0, 1.0))


def _rates(problem: Problem) -> Iterator[_Tried]:
    """Yield other rates of the clock: times stated in other units, or a controller that is slower than it says."""
    for rate in RATES:
        logs = [replace(log, fs=log.fs * rate) for log in problem.logs]
        yield _Tried("rate", "clock", None, (rate - 1,), problem.with_logs(logs))


def _exchanged(problem: Problem) -> Iterator[_Tried]:
    n = problem.basis.n
    driven = [j for j in range(n) if np.any(problem.factors.R[j, :, -1])]
    for j, k in combinations(driven, 2):
        order = np.arange(n)
        order[[j, k]] = k, j
        yield _Tried("exchanged", "torque", j, (k + 1.0,), _changed(problem, tau=np.eye(n)[order]))


def _gravities(problem: Problem) -> Iterator[_Tried]:
    """Yield gravity the other way, none, and along the other axes of the base."""
    tree = next((block.tree for block in problem.basis.blocks if isinstance(block, TreeLinks)), None)
    if tree is None or not np.any(tree.gravity):
        return
    g = float(np.linalg.norm(tree.gravity))
    across = [sign * g * a for a in np.linalg.svd(tree.gravity[None])[2][1:] for sign in (1, -1)]
    for gravity in (-tree.gravity, ALMOST_NONE * tree.gravity, *across):
        moved = replace(tree, gravity=gravity)
        blocks = tuple(replace(b, tree=moved) if isinstance(b, TreeLinks) else b for b in problem.basis.blocks)
        yield _Tried(
            "gravity", "base", None, tuple(gravity.tolist()), problem.with_basis(replace(problem.basis, blocks=blocks))
        )


def _turned(problem: Problem) -> Iterator[_Tried]:
    """Yield the position of each joint with the other sign, and from other zeros."""
    n = problem.basis.n
    for j in range(n):
        yield _Tried("sign", "position", j, (-1.0,), _changed(problem, q=_diagonal(n, j)))
        for turn in () if j in problem.basis.slides else (np.pi / 2, -np.pi / 2, np.pi):
            moved = [replace(log, q=log.q - turn * (np.arange(n) == j)) for log in problem.logs]
            yield _Tried("zero", "position", j, (turn,), problem.with_logs(moved))
