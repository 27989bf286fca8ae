"""Descent from several starts, of which the best are followed further."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy

from idbench.identify.arrays import Array
from idbench.identify.data.kinematics import Limits
from idbench.identify.design.information import Information
from idbench.identify.design.plan import Plan
from idbench.identify.design.shapes import quintic

POOL = 200  # Moves to choose from, each time
INSTANTS = 8  # States of a move
FIRST = 1e-3  # Share of a move's information that counts as known before the first: it makes the matrix regular
PEAKS = 15 / 8, 10 / np.sqrt(3)  # Largest velocity and acceleration of a fifth-order move of unit length and time


@dataclass(frozen=True, eq=False)
class Greedy:
    """Chooses moves from random ones by the determinant of the information that they make together."""

    information: Information
    """What motions tell."""
    limits: Limits
    """What they must keep."""
    T: float
    """Time of a move [s]."""
    known: Array
    """Information of earlier logs, shape (p, p)."""

    def waypoints(self, rng: np.random.Generator, count: int) -> Array:
        """Return the beginnings of so many moves, from the middle of the ranges, shape (count, joint); the last leads back."""
        reached, M = [np.zeros(len(self.limits.velocity))], self.known
        for k in range(count - 1):
            pool = self.pool(rng, reached[-1], (count - 1 - k), POOL)
            each = self._matrices(reached[-1], pool)
            M = M + FIRST * each.mean(axis=0) if k == 0 else M
            best = int(np.argmax(np.linalg.slogdet(M + each)[1]))
            reached.append(pool[best])
            M = M + each[best]
        return np.array(reached)

    def pool(self, rng: np.random.Generator, at: Array, left: int, count: int) -> Array:
        """Return random waypoints that can be reached from one, and from which the first can in `left` moves."""
        by_velocity = self.limits.velocity * self.T / PEAKS[0]
        reach = np.minimum(by_velocity, self.limits.acceleration * self.T**2 / PEAKS[1])  # of every joint [rad]
        half = np.diff(self.limits.position, axis=1)[:, 0] / 2
        low = np.maximum(np.maximum(at - reach, -half), -left * reach)
        high = np.minimum(np.minimum(at + reach, half), left * reach)
        return rng.uniform(np.minimum(low, high), high, (count, len(at)))

    def _matrices(self, at: Array, pool: Array) -> Array:
        """Return the information of moves, shape (move, p, p)."""
        shape = quintic((np.arange(INSTANTS) + 0.5) / INSTANTS) / self.T ** np.arange(4)[:, None]
        motion = (pool - at)[:, None, None, :] * shape[:, :, None]
        motion[:, 0] += self.limits.middle + at
        information = replace(self.information, rate=INSTANTS / self.T)
        return information.matrix(information.weighted(motion))


MEMORY = 20  # Steps that L-BFGS remembers


class DesignSearch:
    """Minimises what plans cost from several coefficients, shape (m, joint); what was found outlives an interruption.

    Progress, the share of all steps that is done, is reported from 0 to 1.
    """

    def __init__(self, starts: Sequence[Array], steps: int, progress: Callable[[float], None] | None = None) -> None:
        self.found, self.interrupted = list(starts), False
        self._steps, self._done, self._progress = steps, 0, progress

    @property
    def best(self) -> Array:
        """The best coefficients, by the plan that was followed last."""
        return self.found[0]

    def run(self, plan: Plan, keep: int, rounds: int) -> None:
        """Descend from the best `keep` of what was found, by L-BFGS, `rounds` steps each; Ctrl-C ends it with what there is."""
        if self.interrupted:
            return
        ends = [_End(np.inf, start) for start in self.found[:keep]]
        try:
            for end in ends:
                self._descend(plan, end, rounds)
        except KeyboardInterrupt:
            self.interrupted = True
        self.found = [end.c for end in sorted(ends, key=lambda end: end.cost)]

    def _descend(self, plan: Plan, end: "_End", rounds: int) -> None:
        """Descend from an end, which is kept up to date."""
        shape, before, steps = end.c.shape, self._done, 0

        def value(flat: Array) -> tuple[float, Array]:
            cost, slope = plan.value(flat.reshape(shape))
            if cost < end.cost:
                end.cost, end.c = cost, flat.reshape(shape).copy()
            return cost, slope.ravel()

        def step(_: Array) -> None:
            nonlocal steps
            steps += 1
            if self._progress:
                self._progress(min(1.0, (before + steps) / self._steps))

        minimize: Any = scipy.optimize.minimize  # its types know no functions of arrays of one dimension
        options = {"maxiter": rounds, "maxcor": MEMORY}
        minimize(value, end.c.ravel(), jac=True, method="L-BFGS-B", callback=step, options=options)
        self._done = before + rounds


@dataclass
class _End:
    """Where a descent has come to."""

    cost: float
    c: Array
