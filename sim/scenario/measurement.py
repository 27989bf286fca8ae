"""How the torque comes into the log."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from idbench.identify.data.motion_log import TorqueChannel
from idbench.sim.errors import ScenarioError
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.settings import (
    EachCount,
    EachNotNegative,
    EachNumber,
    EachShareError,
    NotNegative,
    Number,
    Positive,
    per_joint,
    settings,
)


@settings
class TorqueMeasurement:
    """What the log's torque is made of: the current reference, as in the paper (Eq. 13), or a measured current."""

    source: Literal["reference", "current"] = "reference"
    """reference: the commanded torque, sample by sample; current: the motor current, measured when a sample is taken."""
    gain_error: EachShareError = (0.0,)
    """Error of the gain G_T by which the log was turned into N m, as a share, of all joints or of each."""
    offset: EachNumber = (0.0,)
    """Constant error [N m], of all joints or of each."""
    noise: EachNotNegative = (0.0,)
    """White noise, rms [N m], of all joints or of each."""
    resolution: EachNotNegative = (0.0,)
    """Step of the converter [N m], of all joints or of each: twice its range over 2^bits; 0 is exact."""
    cutoff: Positive | None = None
    """Anti-alias filter of the measured current, first order [Hz]; without it none."""

    def __post_init__(self) -> None:
        if self.cutoff and self.source == "reference":
            raise ScenarioError(f"cutoff = {self.cutoff:g} Hz needs source = 'current': a reference is not filtered")

    @property
    def recorded(self) -> Literal["command", "current"]:
        """What of a simulation the log has."""
        return "current" if self.source == "current" else "command"

    def spread(self, n: int) -> Array:
        """Return the standard deviation of the noise in the torques of `n` joints, that of the converter included [N m]."""
        noise, step = (per_joint(getattr(self, name), n, f"torque.{name}") for name in ("noise", "resolution"))
        return np.hypot(noise, step / np.sqrt(12))

    def logged(self, tau: Array, n: int, rngs: Sequence[np.random.Generator]) -> Array:
        """Logged torques for the torques `tau` [N m], shape (nsim, time, joint)."""
        gain, offset, noise, step = (
            per_joint(getattr(self, name), n, f"torque.{name}") for name in ("gain_error", "offset", "noise", "resolution")
        )
        drawn = np.stack([rng.standard_normal(tau.shape[1:]) for rng in rngs])
        measured = (1 + gain) * tau + offset + noise * drawn
        return np.where(step > 0, np.rint(measured / np.where(step > 0, step, 1.0)) * step, measured)

    def channel(self, delay: float, lag: float, fs: float) -> TorqueChannel:
        """Meaning of the log's torque, when a command acts `delay` [s] after its sample and the torque `lag` later.

        A measured current is what earlier commands have left when a sample is taken. The last of them had a share
        1 - exp(-(T - r)/tau) of the filter's output, with T = 1/fs, r = delay modulo T and tau its time constant; those
        before it follow geometrically. The channel states their mean delay.
        """
        if self.source == "reference":
            return TorqueChannel("held", delay + lag)
        T = 1 / fs
        r = max(0.0, delay - int(delay * fs + 1e-9) * T)  # a command that acts as the sample is taken is not in it yet
        tau = 1 / (2 * np.pi * self.cutoff) if self.cutoff else 0.0
        earlier = np.exp(-(T - r) / tau) / -np.expm1(-T / tau) if tau else 0.0
        return TorqueChannel("held", float(r - T * (1 + earlier) + lag))


Harmonics = Annotated[tuple[Number, ...], Field(min_length=1)]


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

    def truth(self, robot: Robot) -> dict[str, float]:
        """Parameters of the cogging as friction that resists, C36s sin(36 q) + C36c cos(36 q), by name [N m]."""
        series, found = self.start(robot)[0], dict[str, float]()
        for j, (size, order, phase) in enumerate(zip(series.amplitude, series.order, series.phase, strict=True)):
            for k, share in enumerate(series.harmonics if size else (), 1):
                found[f"C{k * order:g}s{j + 1}"] = 0.0 - float(size * share * np.cos(k * phase))
                found[f"C{k * order:g}c{j + 1}"] = 0.0 - float(size * share * np.sin(k * phase))
        return found

    def start(self, robot: Robot) -> "tuple[RippleSeries, RippleSeries]":
        """Return cogging torque [N m], and torque constant over its mean, minus 1; motors are only asked for if there is any.

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
        cogging = self.cogging * (motors.cogging if motors else still)
        return (
            RippleSeries(cogging, *slots, self.cogging_harmonics),
            RippleSeries(share, bars, still, self.commutation_harmonics),
        )


@dataclass(frozen=True, eq=False)
class RippleSeries:
    """Sum over k of amplitude * harmonics[k - 1] * sin(k (order q + phase))."""

    amplitude: Array
    order: Array
    phase: Array
    harmonics: tuple[float, ...]
