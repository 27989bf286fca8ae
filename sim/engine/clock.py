"""Which sample and which command a physics step belongs to."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from idbench.sim.robot.motors import Array


@dataclass(frozen=True)
class Clock:
    """Samples are taken every `per_sample` physics steps, from step 0; a command acts `delay` after its sample."""

    per_sample: int
    """Physics steps a sample."""
    h: float
    """Physics step [s]."""
    delay: float
    """Computing delay [s], not below zero."""

    @cached_property
    def late(self) -> int:
        """Whole physics steps between a sample and the step in which its command begins to act."""
        return int(self.delay / self.h + 1e-9)

    @cached_property
    def old(self) -> float:
        """Share of that step in which the command before still acts."""
        return max(0.0, self.delay / self.h - self.late)

    def sample(self, step: int) -> int | None:
        """Return the sample that is taken at the beginning of a step, if one is."""
        k, after = divmod(step, self.per_sample)
        return None if after else k

    def command(self, step: int) -> tuple[int, int]:
        """Return the command that acts in a step, below zero before the first, and how many steps it has acted for."""
        return divmod(step - self.late, self.per_sample)

    def undisturbed(self, step: int) -> int:
        """Return for how many steps, this one included, neither a sample is taken nor a command begins to act."""
        _, after = self.command(step)
        return min(self.per_sample - after, self.per_sample - step % self.per_sample)


class History:
    """Positions and velocities of the last `reach` physics steps of `h` [s], of `nsim` simulations of `n` joints."""

    def __init__(self, reach: int, nsim: int, n: int, h: float) -> None:
        self._h = h
        self._size = reach + 2
        self._sim = np.arange(nsim)
        self._q, self._qd = np.zeros((2, self._size, nsim, n))
        self._last = -1

    def put(self, step: int, q: Array, qd: Array) -> None:
        """Remember the state at the beginning of physics step `step`."""
        self._q[step % self._size], self._qd[step % self._size] = q, qd
        self._last = step

    def whole(self, step: int) -> Array:
        """Return positions [rad], shape (nsim, joint), at the beginning of a physics step."""
        return self._q[min(max(step, 0), self._last) % self._size].copy()

    def at(self, x: Array) -> Array:
        """Return positions [rad], shape (nsim, joint), at the instants `x`, shape (nsim,), counted in physics steps.

        Between steps by the cubic that has their positions and velocities; before the first step, the first.
        """
        x = np.maximum(x, 0.0)
        before = np.minimum(np.floor(x).astype(np.int64), self._last)
        after = np.minimum(before + 1, self._last)
        s = (x - before)[:, None]
        q0, q1 = (self._q[k % self._size, self._sim] for k in (before, after))
        v0, v1 = (self._qd[k % self._size, self._sim] * self._h for k in (before, after))
        rise = q1 - q0
        return q0 + s * (v0 + s * ((3 * rise - 2 * v0 - v1) + s * (v0 + v1 - 2 * rise)))
