"""Kinds of motions that can be made exciting."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from idbench.experiments.errors import ExperimentError
from idbench.identify.arrays import Array
from idbench.identify.design.plan import Plan
from idbench.identify.design.search import Greedy
from idbench.identify.design.shapes import Shapes
from idbench.identify.plugins import PluginTable
from idbench.sim.trajectories import Fourier, Quintic
from idbench.sim.trajectories.trajectory import AbstractTrajectory

FEWEST = 3  # Moves that lead back
REST = 1.0  # Time at rest before and after a motion [s]: as much as filters look to either side
WAY_OUT = "give a longer --duration or a higher --frequency"  # Where a motion would have too few shapes


class AbstractExcitation(ABC):
    """A kind of motion that is linear in its coefficients, and rests where it begins and ends, at the same place.

    Its frequency [Hz] says how fast it may change: of the paces that a duration allows, the nearest is taken.
    """

    @abstractmethod
    def shapes(self, t: Array, duration: float, frequency: float) -> Shapes:
        """Return the unit motions at times `t` [s]."""

    @abstractmethod
    def random(self, rng: np.random.Generator, plan: Plan, duration: float, frequency: float) -> Array:
        """Return coefficients of a random motion, shape (m, joint), before it is scaled into its limits."""

    @abstractmethod
    def trajectory(self, c: Array, middle: Array, duration: float, repeat: int) -> AbstractTrajectory:
        """Return the trajectory, of a scenario, of coefficients that are scaled, about the middle of the ranges [rad]."""

    def starts(self, rng: np.random.Generator, plan: Plan, duration: float, frequency: float, count: int) -> list[Array]:
        """Return coefficients to begin the search with; random ones unless a kind has others."""
        return [self.random(rng, plan, duration, frequency) for _ in range(count)]


@dataclass(frozen=True)
class FourierExcitation(AbstractExcitation):
    """Finite Fourier series, whose period is the duration."""

    def shapes(self, t: Array, duration: float, frequency: float) -> Shapes:
        """Return a constant and harmonics up to the frequency."""
        harmonics = int(frequency * duration + 1e-9)
        if harmonics < 2:
            raise ExperimentError(f"{duration:g} s have no two harmonics up to {frequency:g} Hz: {WAY_OUT}")
        return Shapes.fourier(t, duration, harmonics)

    def random(self, rng: np.random.Generator, plan: Plan, duration: float, frequency: float) -> Array:
        """Return harmonics of like velocities, about any position."""
        c = rng.standard_normal((plan.states.count, len(plan.limits.velocity)))
        c[0] = rng.uniform(-0.5, 0.5, c.shape[1]) * np.diff(plan.limits.position, axis=1)[:, 0] / 2 * 2 * np.pi / duration
        c[1:] *= plan.limits.velocity * rng.uniform(0.2, 1.0)
        return c

    def starts(self, rng: np.random.Generator, plan: Plan, duration: float, frequency: float, count: int) -> list[Array]:
        """Return the series nearest to moves that are chosen one after the other: of random ones fewer end well."""
        if round(duration * frequency) < FEWEST:
            return super().starts(rng, plan, duration, frequency, count)
        t = (np.arange(plan.states.values.shape[1]) + 0.5) * duration / plan.states.values.shape[1]
        moves = MovesExcitation()
        number = moves.count(duration, frequency)
        shapes = Shapes.moves(t, duration, number)
        each = moves.starts(rng, plan, duration, frequency, count)
        # Nearest are positions, velocities and accelerations together.
        scale = (duration / number / np.pi) ** np.arange(3)[:, None, None]
        B = (plan.states.values[:3] * scale).reshape(-1, plan.states.count)
        ends = ((shapes.at(c)[:3] * scale).reshape(len(B), -1) for c in each)
        return [np.asarray(np.linalg.lstsq(B, y, rcond=None)[0]) for y in ends]

    def trajectory(self, c: Array, middle: Array, duration: float, repeat: int) -> Fourier:
        """Return the series."""
        mean, sines, cosines = Shapes.series(c, duration)
        return Fourier(duration, tuple(mean + middle), _rows(sines), _rows(cosines), repeat, 0.0, REST)


@dataclass(frozen=True)
class MovesExcitation(AbstractExcitation):
    """Fifth-order moves of equal duration, for controllers that accept only points."""

    def shapes(self, t: Array, duration: float, frequency: float) -> Shapes:
        """Return a waypoint each."""
        return Shapes.moves(t, duration, self.count(duration, frequency))

    def random(self, rng: np.random.Generator, plan: Plan, duration: float, frequency: float) -> Array:
        """Return a random walk that leads back."""
        greedy, reached = self._greedy(plan, duration, frequency), [np.zeros(len(plan.limits.velocity))]
        for left in range(self.count(duration, frequency) - 1, 0, -1):
            reached.append(greedy.pool(rng, reached[-1], left, 1)[0])
        return np.array(reached)

    def starts(self, rng: np.random.Generator, plan: Plan, duration: float, frequency: float, count: int) -> list[Array]:
        """Return moves that are chosen one after the other."""
        greedy, moves = self._greedy(plan, duration, frequency), self.count(duration, frequency)
        return [greedy.waypoints(rng, moves) for _ in range(count)]

    def trajectory(self, c: Array, middle: Array, duration: float, repeat: int) -> Quintic:
        """Return the moves."""
        points = _rows(np.concatenate([np.tile(c, (repeat, 1)), c[:1]]) + middle)
        return Quintic(points, (duration / len(c),) * (repeat * len(c)), REST)

    def _greedy(self, plan: Plan, duration: float, frequency: float) -> Greedy:
        return Greedy(plan.information, plan.limits, duration / self.count(duration, frequency), plan.known)

    def count(self, duration: float, frequency: float) -> int:
        """Return the number of moves; raise ExperimentError if there are too few to lead back."""
        count = round(duration * frequency)
        if count < FEWEST:
            raise ExperimentError(f"{duration:g} s are no three moves, {frequency:g} a second: {WAY_OUT}")
        return count


def _rows(x: Array) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(float(value) for value in row) for row in x)


EXCITATIONS: PluginTable[AbstractExcitation] = PluginTable(
    "excitations",
    AbstractExcitation,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {"fourier": FourierExcitation, "moves": MovesExcitation},
)
