"""Moves that are chosen one after the other, each the most informative one beside those before it."""

from dataclasses import dataclass, replace

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.data.limits import Limits
from idbench.identify.design.information import Information
from idbench.identify.design.shapes import quintic

POOL = 200
"""Moves to choose from, each time."""

INSTANTS = 8
"""States of a move."""

FIRST = 1e-3
"""Share of a move's information that counts as known before the first: it makes the matrix regular."""

PEAKS = 15 / 8, 10 / np.sqrt(3)
"""Largest velocity and acceleration of a fifth-order move of unit length and time."""


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
        reach, half = self.reach, np.diff(self.limits.position, axis=1)[:, 0] / 2
        low = np.maximum(np.maximum(at - reach, -half), -left * reach)
        high = np.minimum(np.minimum(at + reach, half), left * reach)
        low = np.minimum(low, high)
        return rng.uniform(low, high, (count, len(at)))

    @property
    def reach(self) -> Array:
        """Longest move of every joint [rad], shape (joint,)."""
        by_velocity = self.limits.velocity * self.T / PEAKS[0]
        return np.minimum(by_velocity, self.limits.acceleration * self.T**2 / PEAKS[1])

    def _matrices(self, at: Array, pool: Array) -> Array:
        """Return the information of moves, shape (move, p, p)."""
        u = (np.arange(INSTANTS) + 0.5) / INSTANTS
        shape = quintic(u) / self.T ** np.arange(4)[:, None]
        motion = (pool - at)[:, None, None, :] * shape[:, :, None]
        motion[:, 0] += self.limits.middle + at
        information = replace(self.information, rate=INSTANTS / self.T)
        return information.matrix(information.weighted(motion))
