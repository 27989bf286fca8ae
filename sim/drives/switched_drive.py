"""A DC motor behind an H-bridge chopper, the winding resolved between the edges of the pulses."""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np
from pydantic import Field

from idbench.sim.drives.averaged_drive import limits
from idbench.sim.drives.drive import AbstractAmplifier, AbstractDrive, BetweenEdges, Electric, Trace, every
from idbench.sim.drives.pwm import Modulation, Modulator, pieces, within
from idbench.sim.drives.winding import Loops, PeriodTable, Winding, Windings, pass_period, straight, stretches
from idbench.sim.errors import ScenarioError
from idbench.sim.robot.motors import Array, Motors
from idbench.sim.robot.robot import Robot
from idbench.sim.settings import EachPositiveOrNone, NotNegative, Number, Positive, Share, settings

MAX_VALUES = 20_000  # Values of the modulation index beyond which no table is made


@dataclass(frozen=True, eq=False)
class ExactPassages:
    """Passages computed period by period, for any modulation index."""

    winding: Winding
    """Shape (sim, joint)."""
    modulator: Modulator
    """Its chopper."""

    least: float = 0.0
    """Step of the modulation index, 0 if it has none."""

    def advance(self, loops: Loops, windings: Windings, wanted: Array, emf: Array) -> Array:
        """Advance windings by PWM periods, in arrays over windings; arguments and what is returned as for `periods`."""
        done = np.empty((4, *emf.shape))
        charge, before, after, index = done
        for k, e in enumerate(emf):
            error = wanted - windings.i
            asked = loops.kp * error + windings.sum + loops.known * e
            v = within(asked, loops.most)
            windings.sum[:] += loops.ki * error * (v == asked)
            m = v / self.winding.V
            index[k], before[k] = np.rint(m / self.least) * self.least if self.least else m, windings.i
            after[k], charge[k] = pass_period(windings.i, index[k], e, self.winding, self.modulator)
            windings.i[:] = after[k]
        return done


@dataclass(frozen=True, eq=False)
class TabulatedPassages:
    """The same passages, from a table: while a current keeps its sign, all that a period does is linear in it and in the EMF.

    The modulation index is a multiple of `least`, so that few linear functions occur; their coefficients come from three
    passages each.
    """

    winding: Winding
    """Shape (sim, joint), the same for all simulations."""
    modulator: Modulator
    """Its chopper."""
    least: float
    """Step of the modulation index."""

    def advance(self, loops: Loops, windings: Windings, wanted: Array, emf: Array) -> Array:
        """Advance windings by PWM periods, as `ExactPassages` does."""
        from idbench.sim.drives.periods import periods  # loads a compiler

        return np.asarray(periods(self._table, loops, windings, wanted, np.ascontiguousarray(emf)))

    @cached_property
    def _table(self) -> PeriodTable:
        """What compiled code takes: number of the index 1, where that of 0 is 0, linear functions, and pieces of periods."""
        V, R, L = (np.ascontiguousarray(x[0]) for x in self.winding)
        highest = int(np.ceil(1 / self.least))
        indices = np.arange(-highest, highest + 1, dtype=np.float64) * self.least
        cut = pieces(self.modulator, indices)
        kept = np.exp(-cut.duration[..., None] * (R / L))
        each = [np.broadcast_to(x[..., None], kept.shape) for x in cut]
        of_pieces = np.ascontiguousarray(np.stack([*each, kept], axis=-1).swapaxes(0, 1))
        return PeriodTable(self.least, highest, self._linear(indices), of_pieces, V, R, L, bool(self.modulator.dead_time))

    def _linear(self, indices: Array) -> Array:
        """Charge and the currents at edges, (sign, value, joint) -> (constant, by i, by e) x quantity."""
        shape = 2, len(indices), self.winding.V.shape[-1]
        winding = Winding(*(np.broadcast_to(x[0], shape) for x in self.winding))
        m = np.broadcast_to(indices[:, None], shape)
        pattern = self.modulator.pattern(m, np.broadcast_to(np.array([0.0, 1.0])[:, None, None], shape))
        made = []
        for i, e in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)):
            passage, edges = straight(np.full(shape, i), np.full(shape, e), winding, pattern, self.modulator.period)
            made.append(np.stack([passage.charge, *edges], axis=-1))
        constant, by_i, by_e = made
        return np.stack([constant, by_i - constant, by_e - constant], axis=-2)


@settings
class SwitchedDrive(AbstractDrive):
    """H-bridge chopper with a digital PI current loop; torque ripple emerges from its pulses.

    The loop samples the current at the start of every PWM period. Its zero cancels the winding's pole, so that the sampled
    current follows its reference with the pole a = exp(-2 pi bandwidth / pwm). A physics step is a PWM period; the plant gets
    the mean torque of the period.
    """

    pwm: Positive = 5000.0
    """Switching frequency [Hz], a whole multiple of fs."""
    modulation: Modulation = "unipolar"
    """unipolar (phase-shifted legs), bipolar, or sign_magnitude."""
    bandwidth: Positive = 500.0
    """Bandwidth of the current loop [Hz], below a fifth of the switching frequency."""
    dead_time: NotNegative = 520e-9
    """Time for which both transistors of a leg are off before one turns on [s]; below a tenth of the PWM period."""
    emf_compensation: Share = 1.0
    """Share of the back-EMF that the current loop feeds forward; without it the motor seems to have more inertia."""
    duty_resolution: Annotated[Number, Field(ge=0, le=0.1)] = 0.001
    """Step of the duty, as a share of the period; 0 is exact."""
    bus_voltage: EachPositiveOrNone = None
    """Bus voltage [V], of all joints or of each; without it, or where the robot's motors have less, theirs holds."""
    current_limit: EachPositiveOrNone = None
    """Largest current [A], of all joints or of each; without it, or where the robot's motors have less, theirs holds."""

    def __post_init__(self) -> None:
        if self.dead_time * self.pwm >= 0.1:
            raise ScenarioError(f"dead_time = {self.dead_time:g} s must be below a tenth of the period, {0.1 / self.pwm:g} s")
        if self.bandwidth > self.pwm / 5:
            raise ScenarioError(f"bandwidth = {self.bandwidth:g} Hz must be at most a fifth of pwm = {self.pwm:g} Hz")

    def start(self, robot: Robot, nsim: int, h: float) -> AbstractAmplifier:
        """Return the drive without current."""
        V, I = limits(robot, self.bus_voltage, self.current_limit)  # noqa: E741
        if not np.isfinite(V).all():
            raise ScenarioError("drive.bus_voltage is needed: the robot's motors give none")
        return SwitchedAmplifier(self, robot.motors, V, I, nsim, h)

    def lag(self, robot: Robot) -> Array:
        """Return T / (1 - a) - T / 2, from the sampled loop and the hold of its reference."""
        T = 1 / self.pwm
        return np.full(robot.n, T / -np.expm1(-2 * np.pi * self.bandwidth * T) - T / 2)

    def step_length(self, fs: float, longest: float) -> float:
        """Return the PWM period [s].

        Raises
        ------
        ScenarioError
            If it is above `longest`, or does not fit whole times into a sample.
        """
        times = self.pwm / fs
        if times < 1 or abs(times - round(times)) > 1e-9 * times:
            raise ScenarioError(f"drive.pwm = {self.pwm:g} Hz must be a whole multiple of fs = {fs:g} Hz")
        if 1 / self.pwm > longest * (1 + 1e-9):
            raise ScenarioError(f"drive.pwm = {self.pwm:g} Hz makes steps longer than physics.step = {longest:g} s: raise it")
        return 1 / self.pwm


class SwitchedAmplifier(AbstractAmplifier):
    """The chopper at work."""

    def __init__(self, settings: SwitchedDrive, motors: Motors, V: Array, I: Array, nsim: int, h: float) -> None:  # noqa: E741
        R, L, K, V, self._I = (every(x, nsim) for x in (motors.R, motors.L, motors.K, V, I))
        self._K = K
        self._h = h
        self._winding = Winding(V, R, L)
        lost = -np.expm1(-h * R / L)
        kp = R / lost * -np.expm1(-2 * np.pi * settings.bandwidth * h)
        least = settings.duty_resolution * (1 if settings.modulation == "sign_magnitude" else 2)
        kind = TabulatedPassages if least and 2 / least < MAX_VALUES else ExactPassages
        self._passages = kind(self._winding, Modulator(settings.modulation, h, settings.dead_time), least)
        most = 1 - 4 * settings.dead_time / h
        self._most = (np.floor(most / least) * least if least else most) * V
        self._loops = Loops(kp, kp * lost, self._most, settings.emf_compensation)
        self._windings = Windings(*np.zeros((2, *V.shape)))

    def step(self, demand: Array, speed: Array, steps: int) -> Array:
        """Advance by PWM periods; return the mean torque in each."""
        wanted = within(demand / self._K, self._I)
        e = self._K * speed
        charge, before, after, index = self._passages.advance(self._loops, self._windings, wanted, e)
        self.trace = wanted, charge, before, after, e, index
        return charge * (self._K / self._h)

    def electric(self, trace: Trace, dt: Array) -> Electric:
        """Return currents and voltages of PWM periods."""
        reference, charge, before, after, e, index = trace
        V, R, L = (x[0] for x in self._winding)
        voltage = (R * charge + L * (after - before)) / dt + e
        most = self._most[0] / V * (1 - 1e-9)  # as an index is rounded
        limited = (np.abs(reference) >= self._I[0]) | (np.abs(index) >= most)
        return Electric(reference, charge / dt, voltage, index, limited.astype(np.float64), e)

    def between_edges(self, trace: Trace) -> BetweenEdges:
        """Return current and voltage at the edges of PWM periods, and in the middle between them."""
        _, _, before, _, e, index = trace
        one = Winding(*(np.broadcast_to(x[0], before.shape).ravel() for x in self._winding))
        period = pieces(self._passages.modulator, index.ravel())
        start, _, goal, dt = stretches(before.ravel(), e.ravel(), one, period)
        begins = np.cumsum(dt, axis=0) - dt
        since = np.array([0.0, 0.5, 1.0])[:, None, None] * dt
        current = goal + (start - goal) * np.exp(-since * (one.R / one.L))
        voltage = np.broadcast_to(goal * one.R + e.ravel(), current.shape)
        return BetweenEdges(*(
            np.swapaxes(x, 0, 1).reshape(-1, *before.shape) for x in (begins + since, current, voltage)
        ))  # fmt: skip
