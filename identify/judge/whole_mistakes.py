"""Mistakes that are not small: signs, exchanged torques, gravity that points elsewhere, other zeros and rates."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import chain, combinations
from math import ceil

import numpy as np
import numpy.typing as npt

from idbench.identify.arrays import TINY, Array
from idbench.identify.basis.basis import Basis
from idbench.identify.estimators.problem import Problem
from idbench.identify.iterate import minimum
from idbench.identify.judge.fitted_motion import on_tree, tree_of, with_first_link_moments
from idbench.identify.judge.mistake_columns import rotation
from idbench.identify.judge.mistake_rows import MistakeRows
from idbench.identify.judge.mistakes import TILT
from idbench.identify.judge.stretches import held_out_errors, left_unexplained, noise_errors
from idbench.identify.judge.suspect import Suspect
from idbench.identify.judge.torque_gains import DECISIVE, TorqueGains
from idbench.identify.rows.factors import CONVERGED

POOR = 5.0
"""Residuals [% of a joint's torque] above which more is tried than signs of torques, also where no small mistake shows: a wrong
axis leaves tens."""

RATES = (0.8, 0.9, 0.95, 1.05, 1.1, 1.25)  # Rates of the clock, over the stated one, that are tried where something is wrong
RATE_STEP = 0.07  # How far from the best of them, as a share, a better one is looked for: as far as to the next
NEARLY = 0.6  # Share of what a small mistake takes of the likelihood from which on a large one is its alternative
NEARLY_ALL = 0.9  # Share of the gain of the most likely mistake from which on another explains as much
MIRRORED = 0.1  # Distance from -1 of a gain that is called a wrong sign alone
MOST = 3  # Large mistakes that are tried on held-out stretches, the most likely first
ENOUGH = 20.0  # Rows a parameter with which many mistakes are looked for before all of a log is asked

NOTHING_LEFT = 1 / 9
"""Share of squared errors beyond noise that the right sign or axis leaves at most: a wrong one also explains a part of other
mistakes."""

HALF = 0.5  # Share of an error that such a mistake may leave though it is noise: a small one has its own test

GRAVITY = 9.81  # [m/s^2]
DEGREE = np.pi / 180  # [rad]
TURNS, SETTLED = 8, 1.0  # Steps of its direction at most, and what each must take of the misfit
LEAST_TURN = 0.02  # [rad] below which it is that of the file: less is a tilt, which has a test of its own
LARGEST_TURN = 0.7  # [rad] in one of them: half of the way from one axis to the next
ALMOST_NONE = 1e-3  # Share of gravity in torques that are without it: so little that parameters stay apart


@dataclass(frozen=True)
class _Tried:
    cause: str
    of: str
    joint: int | None
    size: tuple[float, ...]
    problem: Problem
    """The problem as it would be without the mistake."""
    gains: tuple[tuple[float, ...], ...] = ()
    """What torques are multiplied by, in the ways that explain the same."""
    like: Problem | None = None
    """The problem with the mistake, if that is not the given one: with the same parameters."""

    @property
    def key(self) -> tuple[str, str, int | None, tuple[float, ...]]:
        """What distinguishes it from others."""
        return self.cause, self.of, self.joint, self.size

    def misfit(self, rows: npt.NDArray[np.intp]) -> float:
        """Return minus twice the log-likelihood without the mistake, as of so many rows of each kind; its rows are not kept.

        Of torques as they were logged: d tau = d (a tau) / a.
        """
        scale = np.log(np.abs(self.gains[0])) if self.gains else np.zeros(1)
        return float(self.problem.with_logs(self.problem.logs).factors.misfit(rows)) - 2 * float(np.sum(rows * scale))


def whole_mistakes(problem: Problem, small: Suspect | None = None) -> list[Suspect]:
    """The mistake without which the rows are by far most likely, by more than a `small` one; several are of torques together.

    One that explains nearly as much as the small one is an alternative of it, which then is returned. Of those that explain
    nearly the same, the first is taken: simple and common ones are tried first.
    """
    explicit = problem.explicit
    before_errors, noise = held_out_errors(explicit), noise_errors(explicit)
    if not (before_errors > noise).any():  # nothing is left that one could explain
        return []
    before, counts = float(explicit.factors.misfit()), explicit.factors.rows
    tried = [*_gains(explicit), *_gravities(explicit), *(_rates(explicit) if small else ())]
    if small or _worst(explicit) > POOR:
        tried += [*_likely(explicit), *_tilted(explicit)]
    gains = [(float(each.like.factors.misfit(counts)) if each.like else before) - each.misfit(counts) for each in tried]
    most = max(gains, default=0.0)
    found = sorted(zip(gains, tried, strict=True), key=lambda one: -one[0] if one[0] < NEARLY_ALL * most else -np.inf)
    for gain, best in found[:MOST]:
        if gain < DECISIVE or (small and gain < NEARLY * small.evidence):
            break
        errors = held_out_errors(best.problem)
        k = int(np.argmax(np.log(before_errors) - np.log(errors)))
        left = left_unexplained(before_errors, errors, noise)[k]
        if left > NOTHING_LEFT or errors[k] > HALF * before_errors[k]:
            continue
        if small and gain < DECISIVE + small.evidence:
            return [replace(small, alternatives=(*small.alternatives, (best.cause, best.joint)))]
        near = [(each.cause, each.joint) for other, each in found if other > NEARLY_ALL * gain and each is not best]
        others = tuple(key for key in dict.fromkeys(near) if key != (best.cause, best.joint))
        pair, unit = (float(before_errors[k]), float(errors[k])), "rad" if best.cause == "zero" else "1"
        t = float(np.sqrt(gain))
        one = Suspect(best.cause, best.of, best.joint, best.size, (0.0,), unit, 0.0, t, others, pair, gain, gains=best.gains)
        return _torque_by_torque(one) if best.gains else [one]
    return []


def _torque_by_torque(gains: Suspect) -> list[Suspect]:
    """The mistake of each torque that is multiplied by something."""
    found = list[Suspect]()
    for j, gain in enumerate(gains.gains[0]):
        if gain != 1:
            cause, size = ("sign", -1.0) if abs(gain + 1) < MIRRORED else ("gain", 1 / gain - 1)
            rivals = [("gain", k) for other in gains.gains[1:] for k, x in enumerate(other) if x != 1 and k != j]
            others = tuple(dict.fromkeys([*rivals, *gains.alternatives]))
            found.append(replace(gains, cause=cause, joint=j, size=(size,), alternatives=others))
    return found


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
    return chain(_in_degrees(problem), _across(problem), _exchanged(problem), _turned(problem))


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


def _gains(problem: Problem) -> Iterator[_Tried]:
    """Yield other gains of the torques, those that are most likely, negative ones among them."""
    if choices := TorqueGains.of(problem).choices():
        gains = [tuple((1 / factors).tolist()) for factors in choices]
        yield _Tried("gain", "torque", None, (), _changed(problem, tau=np.diag(gains[0])), tuple(gains))


def _diagonal(n: int, j: int, by: float = -1.0) -> Array:
    return np.diag(np.where(np.arange(n) == j, by, 1.0))


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
        yield _Tried("exchanged", "joint", j, (k + 1.0,), _changed(problem, q=np.eye(n)[order], tau=np.eye(n)[order]))


def _gravities(problem: Problem) -> Iterator[_Tried]:
    """Yield gravity the other way, and none: a robot on a ceiling, a driver that takes weight out of the torques."""
    if (tree := tree_of(problem.basis)) is not None and np.any(tree.gravity) and not problem.logs[0].poses:
        yield from (_with_gravity(problem, problem.basis, share * tree.gravity) for share in (-1.0, ALMOST_NONE))


def _across(problem: Problem) -> Iterator[_Tried]:
    """Yield gravity along the other axes of the base: a robot on a wall; along each, where the file has none."""
    if (tree := tree_of(problem.basis)) is None or problem.logs[0].poses:  # of which gravity is all there is
        return
    g, there = float(np.linalg.norm(tree.gravity)) or GRAVITY, bool(np.any(tree.gravity))
    axes = np.linalg.svd(tree.gravity[None])[2][1:] if there else np.eye(3)
    free = there and problem.prior is None  # a prior has rows of its own
    basis = with_first_link_moments(problem.basis) if free else problem.basis
    like = problem.with_basis(basis) if free else None
    yield from (_with_gravity(problem, basis, sign * g * a, like) for a in axes for sign in (1, -1))


def _tilted(problem: Problem) -> Iterator[_Tried]:
    """Yield the most likely direction of gravity: [X; tilt] by least squares, turn by turn."""
    tree, counts = tree_of(problem.basis), problem.factors.rows
    if tree is None or not np.any(tree.gravity) or problem.logs[0].poses:
        return
    basis = problem.basis if problem.prior else with_first_link_moments(problem.basis)
    like = problem.with_basis(basis)
    begins = [_with_gravity(problem, basis, tree.gravity, like), *_across(problem)]
    best = min(begins, key=lambda one: one.misfit(counts))
    misfit = best.misfit(counts)
    for _ in range(TURNS):
        if (tilt := _tilt(best.problem)) is None:
            break
        after = _with_gravity(problem, basis, rotation(tilt) @ np.array(best.size), like)
        if not (less := after.misfit(counts)) < misfit - SETTLED:
            break
        best, misfit = after, less
    g = float(np.linalg.norm(tree.gravity))
    if np.linalg.norm(np.array(best.size) - tree.gravity) > LEAST_TURN * g:
        yield best


def _tilt(problem: Problem) -> Array | None:
    """Rotation vector of gravity that the rows show to first order, shape (3,); None where they show none."""
    fit = problem.factors.fit(CONVERGED)
    rows = problem.rows
    candidate = next(MistakeRows(problem.parts, problem.basis, fit.X).of_robot(TILT), None)
    if candidate is None:
        return None
    weight = (np.tile(fit.weight, len(rows.time) // rows.kinds) * rows.valid)[:, None]
    A = np.concatenate([rows.W, candidate.plain[:, :2]], axis=1) * weight
    sizes = np.linalg.lstsq(A, rows.Y * weight[:, 0])[0][-2:]
    tree = tree_of(problem.basis)
    assert tree is not None
    vector = sizes @ np.linalg.svd(tree.gravity[None])[2][1:]
    return vector * min(1.0, LARGEST_TURN / max(float(np.linalg.norm(vector)), TINY))


def _with_gravity(problem: Problem, basis: Basis, gravity: Array, like: Problem | None = None) -> _Tried:
    tree = tree_of(basis)
    assert tree is not None
    elsewhere = problem.with_basis(on_tree(basis, replace(tree, gravity=gravity)))
    if hidden := elsewhere.factors.together.hidden():  # such as first moments about an axis along which gravity now is
        elsewhere = elsewhere.with_basis(elsewhere.basis.without(*hidden))
    return _Tried("gravity", "base", None, tuple(gravity.tolist()), elsewhere, like=like)


def turned_position(problem: Problem, j: int) -> Problem:
    """The problem with the other sign of a position."""
    return _changed(problem, q=_diagonal(problem.basis.n, j))


def _in_degrees(problem: Problem) -> Iterator[_Tried]:
    """Yield positions of hinges that are in degrees: of all, or of one. Without a torque nothing has a size."""
    n = problem.basis.n
    driven = problem.factors.R[:, :, -1].any(axis=1)
    hinges = driven & np.isin(np.arange(n), problem.basis.hinges)
    if not driven.all():
        return
    yield _Tried("unit", "position", None, (DEGREE,), _changed(problem, q=np.diag(np.where(hinges, DEGREE, 1.0))))
    for j in map(int, np.flatnonzero(hinges)) if n > 1 else ():
        yield _Tried("unit", "joint", j, (DEGREE,), _changed(problem, q=_diagonal(n, j, DEGREE)))


def _turned(problem: Problem) -> Iterator[_Tried]:
    """Yield the position of each joint with the other sign, alone and with its torque, and from other zeros."""
    n = problem.basis.n
    for j in range(n):
        yield _Tried("sign", "position", j, (-1.0,), turned_position(problem, j))
        yield _Tried("sign", "joint", j, (-1.0,), _changed(problem, q=_diagonal(n, j), tau=_diagonal(n, j)))
    for j in range(n):
        for turn in () if j in problem.basis.slides else (np.pi / 2, -np.pi / 2, np.pi):
            moved = [replace(log, q=log.q - turn * (np.arange(n) == j)) for log in problem.logs]
            yield _Tried("zero", "position", j, (turn,), problem.with_logs(moved))
