"""What coefficients are worth: information, and how far limits are kept, with slopes."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from idbench.identify.arrays import TINY, Array
from idbench.identify.data.kinematics import Limits
from idbench.identify.design.criteria import AbstractCriterion
from idbench.identify.design.information import Information
from idbench.identify.design.shapes import Shapes

POWER = 64.0
"""Of the norm that stands for the largest of many values, and is smooth; less is smoother, and further below the limits."""

NEAR = 0.97  # Share of a torque limit from which on it costs: states lie between those that are looked at
HARD = 30.0  # What exceeding a limit by all of it costs, squared; halving all sigmas gains 0.7
NOTHING = 1e6  # What motions cost that leave a parameter unknown
SLACK = 0.99  # Share of the limits that motions use, since limits are kept at instants
WAY = np.linspace(0.0, 1.0, 12)[1:-1]  # Shares of the way from home at which it is looked at

Obstacles = Callable[[Array], tuple[float, Array]]
"""Positions, shape (time, joint) -> what being too near to something costs, and its slope."""


@dataclass(frozen=True, eq=False)
class Plan:
    """What is asked of a motion, and what it must keep.

    Positions, velocities, accelerations and jerks keep their limits whatever the coefficients: with u the largest share of a
    limit that a joint uses, in a smooth norm, its motion is divided by (1 + u^p)^(1/p). Torques and obstacles cost.
    """

    information: Information
    """What a motion tells."""
    criterion: AbstractCriterion
    """What is asked of it."""
    limits: Limits
    """What it must keep."""
    states: Shapes
    """The unit motions at the states whose rows count."""
    instants: Shapes
    """The unit motions at more instants, where limits are kept."""
    X: Array
    """Parameters as far as they are known, shape (p,)."""
    known: Array
    """Information of earlier logs, shape (p, p)."""
    prior_error: float = 0.3
    """Share by which each of X may be off, for torques."""
    torque_share: float = 0.8
    """Share of the largest torques that X may take."""
    repeat: int = 1
    """Times that the motion is run."""
    home: Array | None = None
    """Where the arm comes from [rad]: limits hold on the way, too, shape (joint,)."""
    obstacles: Obstacles | None = None
    """What to keep away from."""
    hard: float = HARD
    """What exceeding a limit by all of it costs, squared."""
    power: float = POWER
    """That of the smooth norm by which motions are scaled into their limits; even."""

    def motion(self, c: Array) -> Array:
        """Return the motion at the states, shape (..., 4, time, joint), for coefficients c, shape (..., m, joint)."""
        moved = self.states.at(c * self._scale(c)[0][..., None, :])
        moved[..., 0, :, :] += self.limits.middle
        return moved

    def coefficients(self, c: Array) -> Array:
        """Return the coefficients of the shapes that make the motion, offsets from the middle of the ranges."""
        return c * self._scale(c)[0][..., None, :]

    def matrix(self, motion: Array) -> Array:
        """Return the information of a motion, with what is known."""
        return self.known + self.repeat * self.information.matrix(self.information.weighted(motion))

    def excess(self, c: Array) -> float:
        """Penalty of coefficients, shape (m, joint), beyond the criterion: 0 where limits are kept."""
        whole = self._with_way(self.motion(c))
        cost, _ = self._torque_cost(whole, self.information.columns(whole), self.states.values.shape[1])
        return cost + (self.hard * self.obstacles(whole[0])[0] if self.obstacles else 0.0)

    def value(self, c: Array) -> tuple[float, Array]:
        """Cost of coefficients, shape (m, joint), and its gradient."""
        scale, of_scale = self._scale(c)
        raw = self.states.at(c)
        motion = raw * scale
        motion[0] += self.limits.middle
        cost, slope = self._cost(motion)
        back = np.einsum("dtm,dtj->mj", self.states.values[:3], slope)
        by_scale = np.einsum("dtj,dtj->j", slope, raw[:3])
        return cost, back * scale + by_scale * of_scale

    def _cost(self, motion: Array) -> tuple[float, Array]:
        """Cost of a motion, and its gradient by positions, velocities and accelerations, shape (3, time, joint)."""
        whole, count = self._with_way(motion), motion.shape[-2]
        D = self.information.columns(whole)
        W = D[:count] * self.information.weight(motion)[..., None]
        solved = self.information.whitened(W) * self.repeat
        flat = W.reshape(-1, W.shape[-1])
        M = self.known + flat.T @ solved.reshape(flat.shape)
        value = float(self.criterion.value(M))
        if not np.isfinite(value):
            return NOTHING, np.zeros((3, *motion.shape[1:]))
        of_rows = np.zeros_like(D)
        of_rows[:count] = 2 * solved @ self.criterion.slope(M)
        penalty, of_torques = self._torque_cost(whole, D, count)
        slope = self.information.slope(whole, of_rows, of_torques)
        if self.obstacles:
            near, away = self.obstacles(whole[0])
            penalty += self.hard * near
            slope[0] += self.hard * away
        slope[0, 0] += np.sum(WAY[:, None] * slope[0, count:], axis=0) if self.home is not None else 0.0
        return value + penalty, slope[:, :count]

    def _with_way(self, motion: Array) -> Array:
        """Return a motion, shape (4, time, joint), with postures on the way from home to its start at the end."""
        if self.home is None:
            return motion
        way = np.zeros((len(motion), len(WAY), motion.shape[-1]))
        way[0] = self.home + WAY[:, None] * (motion[0, 0] - self.home)
        return np.concatenate([motion, way], axis=1)

    def _torque_cost(self, motion: Array, D: Array, count: int) -> tuple[float, Array]:
        """Penalty of torques beyond their limits, and its gradient by columns; the mean is that of `count` states."""
        parts = self.information.torques(motion, D, self.X)
        tau, spread = parts.sum(axis=-1), np.abs(parts).sum(axis=-1)
        most, worst = 1 / (self.torque_share * self.limits.torque), 1 / self.limits.torque
        mean, inside = np.sqrt(np.mean(tau[:count] ** 2, axis=0) + TINY), (np.arange(len(tau)) < count)[:, None]
        over = np.maximum(np.abs(tau) * most - NEAR, 0.0)
        above = np.maximum((np.abs(tau) + self.prior_error * spread) * worst - NEAR, 0.0)
        warm = np.maximum(mean / self.limits.rms_torque - NEAR, 0.0)
        cost = self.hard * (np.sum(over**2) + np.sum(above**2) + count * np.sum(warm**2))
        by_mean = inside * warm / mean / self.limits.rms_torque
        by_tau = 2 * self.hard * (np.sign(tau) * (over * most + above * worst) + by_mean * tau)
        by_spread = 2 * self.hard * self.prior_error * above * worst
        return float(cost), (by_tau[..., None] + by_spread[..., None] * np.sign(parts)) * self.X

    def _scale(self, c: Array) -> tuple[Array, Array]:
        """Scale of the joints' motions, shape (..., joint), and its gradient, shape (..., m, joint)."""
        sizes = SLACK * self.limits.sizes
        use = self.instants.at(c) / sizes
        largest = np.abs(use).max(axis=(-3, -2), keepdims=True)
        relative = use / np.maximum(largest, TINY)
        total = np.maximum(np.sum(relative**self.power, axis=(-3, -2)), TINY)  # of no motion at all
        norm = largest[..., 0, 0, :] * total ** (1 / self.power)
        by_use = relative ** (self.power - 1) * total[..., None, None, :] ** (1 / self.power - 1)
        of_norm = np.einsum("dtm,...dtj->...mj", self.instants.values, by_use / sizes)
        size = np.log(np.maximum(norm, TINY))  # powers of large motions would overflow
        log_scale = -np.logaddexp(0.0, self.power * size) / self.power
        scale, by_norm = np.exp(log_scale), -np.exp((self.power + 1) * log_scale + (self.power - 1) * size)
        return scale, by_norm[..., None, :] * of_norm
