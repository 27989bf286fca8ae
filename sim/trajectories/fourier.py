"""Finite Fourier series."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from idbench.sim.errors import ScenarioError
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.settings import NotNegative, Number, Positions, Positive, Whole, settings
from idbench.sim.trajectories.point_to_point import at_rest
from idbench.sim.trajectories.trajectory import AbstractMotion, AbstractTrajectory, Reference

STILL = 1e-6  # Speed, and acceleration, at the ends of a period, as a share of the largest, that counts as rest


@dataclass(frozen=True, eq=False)
class FourierMotion(AbstractMotion):
    """A series that fades in, is run some times, and fades out."""

    series: "Fourier"
    """Its settings."""

    @property
    def duration(self) -> float:
        """Time from the first to the last instant, rest and fading included [s]."""
        s = self.series
        return 2 * (s.rest + s.fade) + s.repeat * s.period

    def at(self, t: Array, fs: float) -> Reference:
        """Return the motion at the times `t` [s], shape (time,)."""
        s = self.series
        inside, end = t - s.rest, self.duration - 2 * s.rest
        clipped = np.clip(inside, 0.0, end)
        g, gd, gdd = _fading(clipped, end, s.fade)
        q, qd, qdd = s.at(clipped - s.fade)
        moves = ((inside >= 0) & (inside <= end))[:, None]
        velocity, acceleration = g * qd + gd * q, g * qdd + 2 * gd * qd + gdd * q
        return Reference(fs, np.array(s.middle) + g * q, velocity * moves, acceleration * moves)


@settings
class Fourier(AbstractTrajectory):
    """A finite Fourier series, q = middle + sum over k of sines_k sin(2 pi k t / period) + cosines_k cos(2 pi k t / period)."""

    period: Positive = 10.0
    """Time after which the motion repeats [s]."""
    middle: tuple[Number, ...] = (0.0, 0.0)
    """Mean position of every joint [rad]."""
    sines: Positions = ((0.5, 0.5), (-0.25, -0.25))
    """Coefficients of the sines, harmonic by harmonic, joint by joint [rad]."""
    cosines: Positions = ((0.0, 0.0), (0.0, 0.0))
    """Coefficients of the cosines, as many [rad]."""
    repeat: Annotated[Whole, Field(ge=1, le=100000)] = 1
    """Periods that are run, one after the other."""
    fade: NotNegative = 0.0
    """Time over which the motion about the middle grows before the first period, and fades after the last [s]; without it the
    series itself must begin at rest."""
    rest: NotNegative = 3.0
    """Time at rest before and after it all [s]: filters settle there."""

    def __post_init__(self) -> None:
        n = len(self.middle)
        if not n or not self.sines or len(self.sines) != len(self.cosines):
            raise ScenarioError(f"{len(self.sines)} sines and {len(self.cosines)} cosines: give as many of both, at least one")
        if any(len(row) != n for row in (*self.sines, *self.cosines)):
            raise ScenarioError(f"every harmonic of sines and cosines needs {n} coefficients, as middle has")
        if self.fade == 0 and not self._rests:
            raise ScenarioError("the series does not begin at rest: give it a time to fade in, such as fade = 2.0")

    @property
    def _rests(self) -> bool:
        """Whether the joints stand at the ends of a period."""
        w = 2 * np.pi * np.arange(1, len(self.sines) + 1)[:, None] / self.period
        parts = w * np.array(self.sines), w**2 * np.array(self.cosines)
        return all((np.abs(x.sum(axis=0)) <= STILL * np.abs(x).sum(axis=0)).all() for x in parts)

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        """Distance of the joints from the middle at the times `t` [s], and its derivatives, shape (time, joint) each."""
        w = 2 * np.pi * np.arange(1, len(self.sines) + 1) / self.period
        sin, cos = np.sin(w * t[:, None]), np.cos(w * t[:, None])
        a, b = np.array(self.sines), np.array(self.cosines)
        return sin @ a + cos @ b, (w * cos) @ a - (w * sin) @ b, -(w**2 * sin) @ a - (w**2 * cos) @ b

    def plan(self, robot: Robot) -> FourierMotion:
        """Return the series."""
        return FourierMotion(self)


def _fading(t: Array, end: float, fade: float) -> tuple[Array, Array, Array]:
    """Return a factor that grows from 0 to 1 and falls again, by moves of fifth order, and its derivatives, shape (time, 1)."""
    if fade == 0:
        one = np.ones((len(t), 1))
        return one, 0 * one, 0 * one
    found = at_rest(np.array([[0.0], [1.0], [1.0], [0.0]]), np.array([fade, end - 2 * fade, fade]), 0.0).at(t, 1.0)
    return found.q, found.qd, found.qdd
