"""The search for the parameters of a servo: Gauss-Newton steps on simulated positions, beside samples of the same metric.

Friction that holds, limits that engage and motions that are thrown make the sum of squares rough: where differences over small
steps mislead, wide ones, and samples spread as the normal equations say, go on.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import product
from typing import Self

import numpy as np
from scipy.special import ndtri

from idbench.identify.arrays import Array
from idbench.identify.nuisances import Nuisances
from idbench.identify.servo.closed_loop import STATES, ServoLoop
from idbench.identify.servo.parameters import SERVO_PARAMETERS

DAMPINGS = 10.0 ** np.arange(-2.0, 4.0)  # Marquardt's parameter, as multiples of the last one that helped
SAMPLES = 12  # Samples a round, in pairs
SETTLED = 3e-4  # Share by which the best of a round must improve the objective
MEDIAN = float(ndtri(0.75))  # Median of the size of a normal number, in standard deviations
IDLE = 2  # Rounds without such an improvement after which a search ends

WORST, RISES = 2, (0.1, 0.4, 1.6)
"""Axes along which other valleys are looked for, and shares by which the objective would grow on the way."""

UNSEEN = 1e-6  # Curvature of an axis, of those scaled to 1, up to which nothing shows along it
AHEAD = 3.0  # Counts by which the beginning of a run may be off
WILD = 4.0  # Times its typical size from which on the sensitivity of a sample counts less: of motions that depend on a hair


@dataclass(frozen=True, eq=False)
class Found:
    """The best parameters of a search."""

    p: dict[str, float]
    """All parameters."""
    cost: float
    """Objective there."""
    residual: Array
    """Measured minus simulated positions [rad], shape (run, sample)."""
    sensitivity: Array
    """Of the simulated positions to the free parameters, shape (run, sample, parameter)."""
    ahead: Array
    """Where runs begin beside what was measured (see `Begin`) [rad], shape (run, 3)."""
    beginnings: Nuisances
    """Other beginnings as unknowns: the encoder says them to a count, and where torque is off nothing makes a run forget them.
    Their precision is the variance of residuals over that of a position that was rounded."""


@dataclass(frozen=True, eq=False)
class ServoSearch:
    """Minimizer of the sum of Fair's function of the residuals, which grows like their size where they are large."""

    loop: ServoLoop
    """Runs to be simulated."""
    free: tuple[str, ...]
    """Parameters that are searched for."""
    scales: Mapping[str, float]
    """Typical sizes, by what `ServoParameter.of` names."""
    c: float
    """Size of a residual from which on it counts less than its square [rad]."""

    def without(self, name: str) -> Self:
        """The same search with a parameter held."""
        return replace(self, free=tuple(other for other in self.free if other != name))

    @property
    def _count(self) -> float:
        """Angle by which runs may begin elsewhere [rad]: where positions are exact, as near as they follow."""
        return self.loop.step or self.c / 3

    @property
    def _certainty(self) -> float:
        """Variance of residuals, a third of c in the median, over that of a rounded position, a twelfth of its square."""
        return float((self.c / 3 / MEDIAN) ** 2 / (self._count**2 / 12))

    def cost(self, q: Array, ahead: Array | float = 0.0) -> Array:
        """Objective of simulated positions, shape (lane,), of runs that begin ahead, shape (lane, run, 3)."""
        r = np.abs(self.loop.q - q) * self.loop.kept / self.c
        away = np.square(ahead).sum(axis=(-2, -1)) if np.ndim(ahead) else 0.0
        total = 2 * self.c**2 * (r - np.log1p(r)).sum(axis=(1, 2)) + self._certainty * away
        return np.nan_to_num(total, nan=np.inf, posinf=np.inf)

    def best(self, start: Mapping[str, float], rounds: int) -> Found:
        """Best parameters that are found from a start.

        Levenberg and Marquardt, x(k+1) = x(k) - (J' J + mu D)^-1 J' r, initial positions eliminated (Schur complement);
        several mu, and samples about the step, are simulated at once, and the best of all is x(k+1).
        """
        x, ahead = np.array([start[name] for name in self.free]), np.zeros((len(self.loop.runs), STATES))
        width, damping, spread, idle = 1.0, 1e-2, 1.0, 0
        rng = np.random.default_rng(0)  # the same samples for everybody
        for _ in range(rounds):
            tried, cost, J, r, beginnings = self._differences(start, x, ahead, width)
            normal = self._normal(J, r, ahead, beginnings)
            steps, promised = self._steps(normal, damping), float(normal.gradient @ normal.inverse @ normal.gradient)
            samples = self._sample_steps(rng, normal, spread * np.sqrt(0.02 * cost[0] / len(x)))
            more = self._within(x, np.concatenate([steps, samples]))
            begins = np.clip(ahead + normal.begin(more - x), -AHEAD * self._count, AHEAD * self._count)
            further = self.cost(self._simulated(start, more, begins), begins)
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
            x, ahead = every[best], begins[place] if place >= 0 else ahead
            if idle >= IDLE or (promised < SETTLED * cost[0] and width < 1):
                break
        return self._found({**start, **dict(zip(self.free, x.tolist(), strict=True))}, ahead, min(width, 0.5))

    def at(self, found: Found) -> Found:
        """Residuals and sensitivities where another search ended."""
        return self._found(found.p, found.ahead, 0.5)

    def _found(self, p: dict[str, float], ahead: Array, width: float) -> Found:
        _, cost, J, r, beginnings = self._differences(p, np.array([p[name] for name in self.free]), ahead, width)
        return Found(p, float(cost[0]), r, J, ahead, beginnings)

    def axis_points(self, found: Found) -> list[dict[str, float]]:
        """Parameters on both sides of what was found, along the axes that are known worst: other valleys lie there."""
        x = np.array([found.p[name] for name in self.free])
        normal = self._normal(found.sensitivity, found.residual, found.ahead, found.beginnings)
        values, axes = np.linalg.eigh((normal.A + normal.A.T) / 2)
        seen = values > UNSEEN  # along others, nothing changes however far one goes
        values, axes = values[seen][:WORST], axes[:, seen]
        size = np.sqrt(found.cost / values)
        ways = product(range(len(size)), RISES, (1, -1))
        steps = [sign * np.sqrt(rise) * size[k] * axes[:, k] / normal.size for k, rise, sign in ways]
        tried = self._within(x, np.array(steps or [0 * x]))  # where nothing has an effect, there is no other place
        return [{**found.p, **dict(zip(self.free, one.tolist(), strict=True))} for one in tried]

    def _within(self, x: Array, steps: Array) -> Array:
        """X with steps, which change no parameter whose size is known by more than a third."""
        relative = np.array([SERVO_PARAMETERS[name].relative > 0 for name in self.free], dtype=bool)
        most = np.where(relative, np.abs(x) / 3, np.inf)
        return np.clip(x + np.clip(steps, -most, most), *self.loop.limits(self.free))

    def _simulated(self, start: Mapping[str, float], X: Array, ahead: Array) -> Array:
        lanes: dict[str, Array | float] = {**start, **dict(zip(self.free, X.T, strict=True))}
        return self.loop.simulate(lanes | {"a": np.broadcast_to(lanes["a"], (len(X),))}, ahead)

    def _differences(
        self, start: Mapping[str, float], x: Array, ahead: Array, width: float
    ) -> tuple[Array, Array, Array, Array, Nuisances]:
        """Points about x, their costs, sensitivity and residual at x, and other beginnings as unknowns."""
        each = ((SERVO_PARAMETERS[name], value) for name, value in zip(self.free, x, strict=True))
        h = width * np.array([p.relative * abs(value) if p.relative else p.share * self.scales[p.of] for p, value in each])
        upper = x + np.diag(h)
        lower = np.maximum(x - np.diag(h), self.loop.limits(self.free)[0])
        n = len(x)
        tried, half = np.concatenate([x[None], upper, lower]), self._count / 2
        sides = half * np.concatenate([np.eye(STATES), -np.eye(STATES)])[:, None, :]
        begins = np.concatenate([np.repeat(ahead[None], len(tried), axis=0), ahead + sides])
        q = self._simulated(start, np.concatenate([tried, np.repeat(x[None], 2 * STATES, axis=0)]), begins)
        wide, kept = np.diagonal(upper - lower), self.loop.kept
        wide = np.where(wide > 0, wide, np.inf)  # what has come to zero, in steps of shares of itself, has no effect
        J = np.moveaxis(q[1 : n + 1] - q[n + 1 : 2 * n + 1], 0, -1) / wide * kept[..., None]
        apart = np.moveaxis(q[-2 * STATES : -STATES] - q[-STATES:], 0, -1) / self._count
        beginnings = Nuisances(apart * kept[..., None], self._certainty)
        return tried, self.cost(q[: -2 * STATES], ahead), J, (self.loop.q - q[0]) * kept, beginnings

    def _normal(self, J: Array, r: Array, ahead: Array, beginnings: Nuisances) -> "_Normal":
        w = 1 / (1 + np.abs(r) / self.c)
        typical = np.sqrt(np.median((J**2).mean(axis=1), axis=0))
        typical = np.where(typical > 0, typical, np.sqrt((J**2).mean(axis=(0, 1))) + 1e-12)
        w = w / (1 + ((J / typical) ** 2).mean(axis=-1) / WILD**2)
        return _Normal(J, r, w, ahead, replace(beginnings, w=w))

    def _steps(self, normal: "_Normal", damping: float) -> Array:
        eye = np.eye(len(normal.size))
        return np.array([np.linalg.solve(normal.A + damping * d * eye, normal.gradient) / normal.size for d in DAMPINGS])

    def _sample_steps(self, rng: np.random.Generator, normal: "_Normal", spread: float) -> Array:
        size = normal.size
        root = np.linalg.cholesky(np.linalg.inv(normal.A + 1e-3 * np.eye(len(size))))
        z = spread * (rng.standard_normal((SAMPLES // 2, len(size))) @ root.T) / size
        return np.concatenate([z, -z])


class _Normal:
    """Weighted normal equations, in which every change of the parameters comes with the best beginnings of the runs.

    `A` is scaled to ones on its diagonal but for what beginnings take, `gradient` likewise, by `size`.
    """

    def __init__(self, J: Array, r: Array, w: Array, ahead: Array, begins: Nuisances) -> None:
        p = J.shape[-1]
        known = np.concatenate([J, r[..., None]], axis=-1)
        follow, free = begins.following(known), begins.without(known).reshape(-1, p + 1)
        both = (J * w[..., None]).reshape(-1, p).T @ free
        self._follow, self._pull = follow[..., :p], follow[..., p] - begins.drawn(ahead)
        A = both[:, :p]
        self.size = np.sqrt(np.maximum(np.diagonal(A), 1e-24))
        self.A = A / np.outer(self.size, self.size)
        self.gradient = (both[:, p] + begins.P * np.einsum("rkp,rk->p", self._follow, ahead)) / self.size
        self.inverse = np.linalg.pinv(self.A, 1e-6, hermitian=True)

    def begin(self, steps: Array) -> Array:
        """Changes of the initial states with steps of the parameters, shape (lane, parameter), as (lane, run, 3)."""
        return np.asarray(self._pull - np.einsum("lp,rkp->lrk", steps, self._follow))
