"""Torque ripple of a motor: cogging and commutation."""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, final

import numpy as np
from pydantic import Field

from idbench.sim.errors import ScenarioError
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.settings import EachCount, EachNotNegative, NotNegative, Number, per_joint, settings

Harmonics = Annotated[tuple[Number, ...], Field(min_length=1)]


@final
@settings
class Ripple:
    """Torque that depends on the rotor's position. PWM ripple is not here: it emerges from the switched drive."""

    cogging: NotNegative = 0.0
    """Cogging torque, in multiples of what the robot's motors have (0: none, 1: theirs)."""
    cogging_harmonics: Harmonics = (1.0,)
    """Amplitudes of the cogging at once, twice, ... the motor's number of slots, relative to the first."""
    commutation: EachNotNegative = (0.0,)
    """Commutation ripple: amplitude as a share of the torque constant, of all joints or of each."""
    commutator_bars: EachCount = (61,)
    """Ripple cycles a turn, of all joints or of each."""
    commutation_harmonics: Harmonics = (1.0,)
    """Amplitudes of the commutation ripple at once, twice, ... the number of bars, relative to the first."""

    def __post_init__(self) -> None:
        if not self.cogging and self.cogging_harmonics != (1.0,):
            raise ScenarioError("cogging_harmonics have no effect without cogging above 0")
        if not any(self.commutation) and self.commutation_harmonics != (1.0,):
            raise ScenarioError("commutation_harmonics have no effect without commutation above 0")
        if max(self.commutation) * sum(abs(a) for a in self.commutation_harmonics) >= 1:
            raise ScenarioError("commutation ripple must stay below the torque constant: lower commutation or its harmonics")

    @property
    def steady(self) -> bool:
        """Whether there is none."""
        return not (self.cogging or any(self.commutation))

    def start(self, robot: Robot) -> "RotorRipple":
        """Return the ripple of the robot's motors, which are only asked for if there is any.

        Raises
        ------
        RobotError
            If there is cogging and a joint has no motor.
        """
        n, still = robot.n, np.zeros(robot.n)
        motors = robot.motors if self.cogging else None
        slots = (motors.order, motors.phase) if motors else (still, still)
        bars = per_joint(self.commutator_bars, n, "ripple.commutator_bars")
        share = per_joint(self.commutation, n, "ripple.commutation")
        return RotorRipple(
            _Series(self.cogging * (motors.cogging if motors else still), *slots, self.cogging_harmonics),
            _Series(share, bars, still, self.commutation_harmonics),
        )


@dataclass(frozen=True, eq=False)
class _Series:
    """Sum over k of amplitude * harmonics[k - 1] * sin(k (order q + phase))."""

    amplitude: Array
    order: Array
    phase: Array
    harmonics: tuple[float, ...]

    @cached_property
    def still(self) -> bool:
        """Whether it is zero everywhere."""
        return not self.amplitude.any()

    def at(self, q: Array) -> Array | float:
        if self.still:
            return 0.0
        angle = self.order * q + self.phase
        parts = [share * np.sin(k * angle) for k, share in enumerate(self.harmonics, 1)]
        return self.amplitude * sum(parts[1:], start=parts[0])


@dataclass(frozen=True, eq=False)
class RotorRipple:
    """The ripple of the motors of a robot."""

    cogging: _Series
    """Torque that needs no current [N m]."""
    commutation: _Series
    """Torque constant over its mean, minus 1."""
