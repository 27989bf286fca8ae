"""What residuals have of the motion: functions of it that predict stretches which were not fitted, and what is noise alone."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from idbench.identify.arrays import TINY, Array
from idbench.identify.estimators.leave_out import Stretches
from idbench.identify.estimators.problem import Problem
from idbench.identify.judge.fitted_motion import FittedMotion
from idbench.identify.judge.stretches import held_torque
from idbench.identify.judge.suspect import Suspect
from idbench.identify.signals.signals import State

BUMPS = np.linspace(-1.5, 1.5, 7)  # Centres of the functions of one variable, in its standard deviations, half of one wide
RIDGE = 0.3  # Of functions, in rows: with less those of 50 variables follow the noise of short logs
PEAK = 0.4
"""Share of a residual's squares in one stretch from which on something happened there: noise is spread over the log. One of
24 s has 12 stretches; noise that is correlated over 0.2 s puts up to a fifth of its squares in one."""


STILL = 1e-9  # Standard deviation, over its largest value, below which a signal is constant but for rounding
WORTH_A_WORD = 2.0  # Error [% of the torque] from which on something that no mistake explains is named
FAINT = 0.15  # Share below which functions predict nothing: of 12 bits and coloured noise they predict up to 0.12


class MotionShare(NamedTuple):
    """What functions of the motion predict of the residual of one joint."""

    rms: float
    """Of the residual [N m, N]."""
    level: float
    """Rms of the torque [N m, N]."""
    share: float
    """Share of its squares on stretches that were not fitted; 1 where it is there for a moment only."""
    variable: str
    """The one variable that predicts most; empty where nothing moves or something happened."""

    @property
    def noise(self) -> float:
        """Rms of what nothing predicts [N m, N]."""
        return self.rms * (1 - (self.share if self.share > FAINT else 0.0)) ** 0.5


def motion_shares(problem: Problem, X: Array) -> list[MotionShare]:
    """What the motion predicts of the residuals of each joint.

        e_j = sum_v f_v(x_v) + noise,   f_v by ridge regression on all stretches but one, tried on that

    Parameters
    ----------
    problem : Problem
        The explicit model, whose rows are kept.
    X : Array, shape (p,)
        Its estimate.
    """
    rows, stretches = problem.rows, Stretches.of(problem.parts)
    measured = rows.by_kind(rows.Y + held_torque(problem.parts))
    e = rows.by_kind((rows.Y - rows.predicted(X)) * rows.valid)
    place = np.concatenate([stretches.at(k, part.rows.time) for k, part in enumerate(problem.parts)])
    place = place.reshape(-1, rows.kinds)[:, 0]
    variables = [_variables(problem, X, k) for k in range(len(problem.parts))]
    every = {name: _scaled(np.concatenate([each[name] for each in variables])) for name in variables[0]}
    found = list[MotionShare]()
    for j in range(problem.basis.n):
        groups = dict(_functions(every, j, problem.basis.n))
        inside = rows.by_kind(rows.valid.astype(float))[j] > 0
        own, where = e[j][inside], place[inside]
        rms, level = (float(np.sqrt(np.mean(x**2))) if len(own) else 0.0 for x in (own, measured[j][inside]))
        if not rms:
            found.append(MotionShare(0.0, level, 0.0, ""))
            continue
        alone = {name: _predicted(group[inside], own, where) for name, group in groups.items()}
        share = _predicted(np.concatenate([group[inside] for group in groups.values()], axis=1), own, where)
        peak = max(np.sum(own[where == k] ** 2) for k in np.unique(where)) / np.sum(own**2)
        best = max(alone, key=lambda name: alone[name])
        if peak > PEAK and len(np.unique(where)) >= 2 / PEAK:
            found.append(MotionShare(rms, level, 1.0, ""))
        else:
            found.append(MotionShare(rms, level, max(share, alone[best], 0.0), best))
    return found


def _variables(problem: Problem, X: Array, k: int) -> dict[str, Array]:
    """Signals of all joints at the rows of a log, shape (row, joint)."""
    part = problem.parts[k]
    state, time = part.signals.state, part.rows.time[:: part.rows.kinds]
    t = np.arange(state.q.shape[-1]) / part.signals.fs
    q, qd, qdd = (np.array([np.interp(time, t, x) for x in y]) for y in (state.q, state.qd, state.qdd))
    conditions = {name: np.array([np.interp(time, t, x) for x in y]) for name, y in state.conditions.items()}
    motion = FittedMotion(problem.basis, X, State(q, qd, lambda _: qdd, conditions), time, part.signals.log.poses)
    return {"position": q.T, "velocity": qd.T, "acceleration": qdd.T, "load": motion.load.T}


def _scaled(x: Array) -> Array:
    """Signals of zero mean and unit variance; 0 of what does not move."""
    size = x.std(axis=0)
    return np.divide(x - x.mean(axis=0), size, out=np.zeros_like(x), where=size > STILL * np.abs(x).max(axis=0))


def _functions(every: dict[str, Array], j: int, n: int) -> Iterator[tuple[str, Array]]:
    """Yield smooth functions of each variable of a joint, and straight ones of those of the others, by name."""
    for name, x in every.items():
        smooth = np.exp(-2 * (x[:, j, None] - BUMPS) ** 2)
        yield name, np.column_stack([x[:, j], smooth, np.sign(x[:, j])])
    if n > 1:
        yield "other joints", np.concatenate([np.delete(x, j, axis=1) for x in every.values()], axis=1)


def _predicted(functions: Array, e: Array, place: Array) -> float:
    """Share of the squares of e that functions predict on stretches that were not fitted."""
    F = np.column_stack([np.ones(len(e)), functions])
    F = F / np.maximum(np.sqrt(np.mean(F**2, axis=0)), TINY)
    A, b, left = F.T @ F + RIDGE * len(e) ** 0.5 * np.eye(F.shape[1]), F.T @ e, np.zeros(len(e))
    for k in np.unique(place):
        own = place == k
        x = np.linalg.solve(A - F[own].T @ F[own], b - F[own].T @ e[own])
        left[own] = e[own] - F[own] @ x
    return 1 - float(np.sum(left**2) / np.sum(e**2))


def something_else(shares: Sequence[MotionShare]) -> Iterator[Suspect]:
    """Yield what no mistake explains though the motion predicts it: at the joint where it is most of the torque."""
    predicted = [(j, each) for j, each in enumerate(shares) if each.share > FAINT]
    every = [(100 * each.rms * each.share**0.5 / max(each.level, TINY), j) for j, each in predicted]
    most, j = max(every, default=(0.0, 0))
    if most > WORTH_A_WORD:
        one, pair = shares[j], tuple(100 * x / max(shares[j].level, TINY) for x in (shares[j].rms, shares[j].noise))
        cause, size = one.variable or "moment", one.rms * one.share**0.5
        yield Suspect("unknown", cause, j, (size,), (0.0,), "N m", 0.0, np.inf, (), (pair[0], pair[1]), 0.0)
