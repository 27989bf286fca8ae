"""The search for the parameters of a servo: Gauss-Newton steps on simulated positions, beside samples of the same metric.

Friction that holds, limits that engage and motions that are thrown make the sum of squares rough: where differences over small
steps mislead, wide ones, and samples spread as the normal equations say, go on.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from identify.arrays import Array
from identify.servo.closed_loop import ServoLoop
from identify.servo.parameters import SERVO_PARAMETERS, lows, step_of

DAMPINGS = 10.0 ** np.arange(-2.0, 4.0)
"""Marquardt's parameter, as multiples of the last one that helped."""

SAMPLES = 12
"""Samples a round, in pairs."""

SETTLED = 3e-4
"""Share by which the best of a round must improve the objective."""

IDLE = 2
"""Rounds without such an improvement after which a search ends."""

WILD = 4.0
"""Times its typical size from which on the sensitivity of a sample counts less: of motions that depend on a hair."""


@final
@dataclass(frozen=True, eq=False)
class Found:
    """The best parameters of a search.

    Parameters
    ----------
    p : dict of str to float
        All parameters.
    cost : float
        Objective there.
    residual : Array, shape (run, sample)
        Measured minus simulated positions [rad].
    sensitivity : Array, shape (run, sample, parameter)
        Of the simulated positions to the free parameters.
    """

    p: dict[str, float]
    cost: float
    residual: Array
    sensitivity: Array


@final
class Search:
    """Minimizes the sum of Fair's function of the residuals, which grows like their size where they are large.

    Parameters
    ----------
    loop : ServoLoop
        Runs to be simulated.
    free : sequence of str
        Parameters that are searched for.
    scales : mapping of str to float
        Typical sizes, by what `ServoParameter.of` names.
    c : float
        Size of a residual from which on it counts less than its square [rad].
    """

    def __init__(self, loop: ServoLoop, free: Sequence[str], scales: Mapping[str, float], c: float) -> None:
        self._loop, self.free, self._scales, self.c = loop, tuple(free), dict(scales), c
        self._low = np.array(lows(self.free))
        self._relative = np.array([SERVO_PARAMETERS[name].relative > 0 for name in self.free], dtype=bool)

    def cost(self, q: Array) -> Array:
        """Return the objective of simulated positions, shape (lane,)."""
        r = np.abs(self._loop.q - q) * self._loop.kept / self.c
        total = 2 * self.c**2 * (r - np.log1p(r)).sum(axis=(1, 2))
        return np.nan_to_num(total, nan=np.inf, posinf=np.inf)

    def best(self, start: Mapping[str, float], rounds: int = 30) -> Found:
        """Return the best parameters that are found from a start."""
        x = np.array([start[name] for name in self.free])
        width, damping, idle, spread = 1.0, 1e-2, 0, 1.0
        rng = np.random.default_rng(0)  # the same samples for everybody
        for _ in range(rounds):
            tried, cost, J, r = self._differences(start, x, width)
            A, gradient, size = self._normal(J, r)
            steps, promised = (
                self._steps(A, gradient, size, damping),
                float(gradient @ np.linalg.pinv(A, 1e-6, hermitian=True) @ gradient),
            )
            scattered = self._scattered(rng, A, size, spread * np.sqrt(0.02 * cost[0] / len(x)))
            more = self._within(x, np.concatenate([steps, scattered]))
            further = self.cost(self._simulated(start, more))
            every, costs = np.concatenate([tried, more]), np.concatenate([cost, further])
            best = int(costs.argmin())
            place = best - len(tried)
            if 0 <= place < len(DAMPINGS):
                damping = float(np.clip(damping * DAMPINGS[place], 1e-6, 10.0))
            elif further[: len(DAMPINGS)].min() > cost[0]:
                damping = min(10.0 * damping, 10.0)
            if place < len(DAMPINGS):
                spread *= 0.8
            idle = idle + 1 if costs[best] > cost[0] * (1 - SETTLED) else 0
            if best == 0:
                width, spread = 0.6 * width, 0.6 * spread
            x = every[best]
            if idle >= IDLE or (promised < SETTLED * cost[0] and width < 1):
                break
        _, cost, J, r = self._differences(start, x, min(width, 0.5))
        return Found({**start, **dict(zip(self.free, x.tolist(), strict=True))}, float(cost[0]), r, J)

    def _within(self, x: Array, steps: Array) -> Array:
        """Return x with steps, which change no parameter whose size is known by more than a third."""
        most = np.where(self._relative, np.abs(x) / 3, np.inf)
        return np.maximum(x + np.clip(steps, -most, most), self._low)

    def _simulated(self, start: Mapping[str, float], X: Array) -> Array:
        lanes: dict[str, Array | float] = {**start, **dict(zip(self.free, X.T, strict=True))}
        return self._loop.simulate(lanes)

    def _differences(self, start: Mapping[str, float], x: Array, width: float) -> tuple[Array, Array, Array, Array]:
        """Return points about x, their costs, and sensitivity and residual at x."""
        h = width * np.array([step_of(name, value, self._scales) for name, value in zip(self.free, x, strict=True)])
        upper, lower = x + np.diag(h), np.maximum(x - np.diag(h), self._low)
        tried = np.concatenate([x[None], upper, lower])
        q, n = self._simulated(start, tried), len(x)
        wide = np.diagonal(upper - lower)
        J = np.moveaxis(q[1 : n + 1] - q[n + 1 :], 0, -1) / wide * self._loop.kept[..., None]
        return tried, self.cost(q), J, (self._loop.q - q[0]) * self._loop.kept

    def _normal(self, J: Array, r: Array) -> tuple[Array, Array, Array]:
        """Return the normal matrix, scaled to ones on its diagonal, the gradient, and the scales."""
        w = 1 / (1 + np.abs(r) / self.c)
        typical = np.sqrt(np.median((J**2).mean(axis=1), axis=0))
        typical = np.where(typical > 0, typical, np.sqrt((J**2).mean(axis=(0, 1))) + 1e-12)
        w = w / (1 + ((J / typical) ** 2).mean(axis=-1) / WILD**2)
        flat = J.reshape(-1, J.shape[-1])
        A = flat.T @ (flat * w.reshape(-1, 1))
        size = np.sqrt(np.maximum(np.diagonal(A), 1e-24))
        return A / np.outer(size, size), (flat.T @ (w * r).ravel()) / size, size

    def _steps(self, A: Array, gradient: Array, size: Array, damping: float) -> Array:
        every = [np.linalg.solve(A + damping * d * np.eye(len(size)), gradient) / size for d in DAMPINGS]
        return np.array(every)

    def _scattered(self, rng: np.random.Generator, A: Array, size: Array, spread: float) -> Array:
        root = np.linalg.cholesky(np.linalg.inv(A + 1e-3 * np.eye(len(size))))
        z = spread * (rng.standard_normal((SAMPLES // 2, len(size))) @ root.T) / size
        return np.concatenate([z, -z])
