"""Mistakes that are not small: signs, exchanged torques, gravity that points elsewhere, other zeros and rates."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations
from math import ceil

import numpy as np
import numpy.typing as npt

from idbench.identify.arrays import Array
from idbench.identify.basis.basis import Basis
from idbench.identify.estimators.problem import Problem
from idbench.identify.iterate import minimum
from idbench.identify.judge.fitted_motion import on_tree, tree_of, with_first_link_moments
from idbench.identify.judge.stretches import held_out_errors
from idbench.identify.judge.suspect import Suspect
from idbench.identify.rows.factors import CONVERGED

POOR = 5.0
"""Residuals [% of a joint's torque] above which more is tried than signs of torques, also where no small mistake shows: a wrong
axis leaves tens."""

DECISIVE = 40.0
"""What a mistake takes of minus twice the logarithm of the likelihood at least: with rows that are correlated over ten of their
steps, four sigma of independent ones."""

RATES = (0.8, 0.9, 0.95, 1.05, 1.1, 1.25)  # Rates of the clock, over the stated one, that are tried where something is wrong
RATE_STEP = 0.07  # How far from the best of them, as a share, a better one is looked for: as far as to the next
NEARLY = 0.6  # Share of what a small mistake takes of the likelihood from which on a large one is its alternative
MOST = 3  # Large mistakes that are tried on held-out stretches, the most likely first
ENOUGH = 20.0  # Rows a parameter with which many mistakes are looked for before all of a log is asked

NOTHING_LEFT = 1 / 3
"""Share of the largest error that the right sign or axis leaves at most: a wrong one also explains a part of other mistakes."""

GRAVITY = 9.81  # [m/s^2]
ALMOST_NONE = 1e-3  # Share of gravity in torques that are without it: so little that parameters stay apart


@dataclass(frozen=True)
class _Tried:
    cause: str
    of: str
    joint: int | None
    size: tuple[float, ...]
    problem: Problem
    """The problem as it would be without the mistake."""

    @property
    def key(self) -> tuple[str, str, int | None, tuple[float, ...]]:
        """What distinguishes it from others."""
        return self.cause, self.of, self.joint, self.size

    def misfit(self, rows: npt.NDArray[np.intp]) -> float:
        """Return minus twice the log-likelihood without the mistake, as of so many rows of each kind; its rows are not kept."""
        return float(self.problem.with_logs(self.problem.logs).factors.misfit(rows))


def whole_mistake(problem: Problem, small: Suspect | None = None) -> Suspect | None:
    """Return the mistake without which the rows are by far most likely, by more than a `small` one; None where none is.

    One that explains nearly as much as the small one is an alternative of it, which then is returned.
    """
    explicit = problem.explicit
    before, counts = float(explicit.factors.misfit()), explicit.factors.rows
    tried = [*_signs(explicit), *_gravities(explicit), *(_rates(explicit) if small else ())]
    if small or _worst(explicit) > POOR:
        tried += _likely(explicit)
    gains = [before - each.misfit(counts) for each in tried]
    found = sorted(zip(gains, tried, strict=True), key=lambda one: -one[0])
    before_errors = held_out_errors(explicit)
    for gain, best in found[:MOST]:
        if gain < DECISIVE or (small and gain < NEARLY * small.evidence):
            break
        errors = held_out_errors(best.problem)
        k = int(np.argmax(np.log(before_errors) - np.log(errors)))
        if errors[k] > NOTHING_LEFT * before_errors[k]:
            continue
        if small and gain < DECISIVE + small.evidence:
            return replace(small, alternatives=(*small.alternatives, (best.cause, best.joint)))
        near = [(each.cause, each.joint) for other, each in found if other > 0.9 * gain and each is not best]
        others = tuple(key for key in dict.fromkeys(near) if key != (best.cause, best.joint))
        pair, unit = (float(before_errors[k]), float(errors[k])), "rad" if best.cause == "zero" else "1"
        return Suspect(best.cause, best.of, best.joint, best.size, (0.0,), unit, 0.0, float(np.sqrt(gain)), others, pair, gain)
    return None


def _likely(problem: Problem) -> Iterator[_Tried]:
    """Yield other axes of gravity, exchanged joints and other zeros, of those that the middle of a long log does not refute."""
    every, log = _others(problem), problem.logs[0]
    length = ceil(log.samples * ENOUGH * len(problem.names) / len(problem.rows.time))
    begin = (log.samples - length) // 2
    if len(problem.logs) > 1 or 2 * length > log.samples:
        yield from every
        return
    few = problem.with_logs([log.part(begin, begin + length)])
    before, counts = float(few.factors.misfit()), few.factors.rows
    left = {each.key for each in _others(few) if not each.misfit(counts) > before} if np.isfinite(before) else None
    yield from (each for each in every if left is None or each.key in left)


def _others(problem: Problem) -> Iterator[_Tried]:
    yield from _across(problem)
    yield from _exchanged(problem)
    yield from _turned(problem)


def _worst(problem: Problem) -> float:
    """Return the largest residual of a joint [% of its torque]."""
    factors = problem.factors
    whole = np.sum(factors.R[..., -1] ** 2, axis=-1)
    share = np.divide(factors.squares(factors.fit(CONVERGED).X), whole, out=np.zeros(whole.shape), where=whole > 0)
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
        if held or flipped.misfit() < factors.misfit() - DECISIVE:
            yield _Tried("sign", "torque", j, (-1.0,), _changed(problem, tau=_diagonal(n, j)))


def _diagonal(n: int, j: int) -> Array:
    return np.diag(np.where(np.arange(n) == j, -1.0, 1.0))


def _rates(problem: Problem) -> Iterator[_Tried]:
    """Yield another rate of the clock, the most likely near the best of some: a controller that is slower than it says."""

    def at(rate: float) -> Problem:
        return problem.with_logs([replace(log, fs=log.fs * rate) for log in problem.logs])

    def unlikely(rate: float) -> float:
        return float(at(rate).factors.misfit(problem.factors.rows))

    best = int(np.argmin([unlikely(rate) for rate in RATES]))
    if unlikely(RATES[best]) > problem.factors.misfit() - DECISIVE:
        return
    low, high = RATES[best] * (1 - RATE_STEP), RATES[best] * (1 + RATE_STEP)
    found = minimum(unlikely, low, high, RATE_STEP / 50)
    yield _Tried("rate", "clock", None, (found - 1,), at(found))


def _exchanged(problem: Problem) -> Iterator[_Tried]:
    n = problem.basis.n
    driven = [j for j in range(n) if np.any(problem.factors.R[j, :, -1])]
    for j, k in combinations(driven, 2):
        order = np.arange(n)
        order[[j, k]] = k, j
        yield _Tried("exchanged", "torque", j, (k + 1.0,), _changed(problem, tau=np.eye(n)[order]))
        yield _Tried("exchanged", "position", j, (k + 1.0,), _changed(problem, q=np.eye(n)[order]))


def _gravities(problem: Problem) -> Iterator[_Tried]:
    """Yield gravity the other way, and none: a robot on a ceiling, a driver that takes weight out of the torques."""
    if (tree := tree_of(problem.basis)) is not None and np.any(tree.gravity):
        yield from (_with_gravity(problem, problem.basis, share * tree.gravity) for share in (-1.0, ALMOST_NONE))


def _across(problem: Problem) -> Iterator[_Tried]:
    """Yield gravity along the other axes of the base: a robot on a wall; along each, where the file has none."""
    if (tree := tree_of(problem.basis)) is None:
        return
    g, there = float(np.linalg.norm(tree.gravity)) or GRAVITY, bool(np.any(tree.gravity))
    axes = np.linalg.svd(tree.gravity[None])[2][1:] if there else np.eye(3)
    free = there and problem.prior is None  # a prior has rows of its own
    basis = with_first_link_moments(problem.basis) if free else problem.basis
    yield from (_with_gravity(problem, basis, sign * g * a) for a in axes for sign in (1, -1))


def _with_gravity(problem: Problem, basis: Basis, gravity: Array) -> _Tried:
    tree = tree_of(basis)
    assert tree is not None
    elsewhere = problem.with_basis(on_tree(basis, replace(tree, gravity=gravity)))
    return _Tried("gravity", "base", None, tuple(gravity.tolist()), elsewhere)


def _turned(problem: Problem) -> Iterator[_Tried]:
    """Yield the position of each joint with the other sign, and from other zeros."""
    n = problem.basis.n
    for j in range(n):
        yield _Tried("sign", "position", j, (-1.0,), _changed(problem, q=_diagonal(n, j)))
        for turn in () if j in problem.basis.slides else (np.pi / 2, -np.pi / 2, np.pi):
            moved = [replace(log, q=log.q - turn * (np.arange(n) == j)) for log in problem.logs]
            yield _Tried("zero", "position", j, (turn,), problem.with_logs(moved))
