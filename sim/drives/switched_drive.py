"""A DC motor behind an H-bridge chopper, the winding resolved between the edges of the pulses."""

from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from idbench.identify.compiled import pointer
from idbench.sim.drives.averaged_drive import limits
from idbench.sim.drives.drive import AbstractAmplifier, AbstractCompiledAmplifier, AbstractDrive, BetweenEdges, Electric, Trace
from idbench.sim.drives.pwm import Modulation, Modulator, Winding, pass_period, pieces, straight, stretches
from idbench.sim.errors import ScenarioError
from idbench.sim.part import Addresses
from idbench.sim.robot.motors import Array, Motors
from idbench.sim.robot.robot import Robot
from idbench.sim.settings import EachPositiveOrNone, NotNegative, Number, Positive, Share, settings

MAX_VALUES = 20_000  # Values of the modulation index beyond which no table is made


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
        exact = ExactPeriods(self, robot.motors, V, I, nsim, h)
        return TabulatedPeriods(exact) if exact.least and 2 / exact.least < MAX_VALUES else exact

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


class ExactPeriods(AbstractAmplifier):
    """The chopper at work, its periods computed one by one for any modulation index, in arrays over windings."""

    def __init__(self, settings: SwitchedDrive, motors: Motors, V: Array, I: Array, nsim: int, h: float) -> None:  # noqa: E741
        R, L, self.K, V, self.I = (np.tile(x, (nsim, 1)) for x in (motors.R, motors.L, motors.K, V, I))
        self.h, self.winding = h, Winding(V, R, L)
        self.modulator = Modulator(settings.modulation, h, settings.dead_time)
        lost = -np.expm1(-h * R / L)
        self.kp = R / lost * -np.expm1(-2 * np.pi * settings.bandwidth * h)
        self.ki, self.known = self.kp * lost, settings.emf_compensation
        self.least = settings.duty_resolution * (1 if settings.modulation == "sign_magnitude" else 2)
        most = 1 - 4 * settings.dead_time / h
        self.most = (np.floor(most / self.least) * self.least if self.least else most) * V
        self._i, self._sum = np.zeros((2, *V.shape))

    def step(self, demand: Array, speed: Array, steps: int) -> Array:
        """Advance by PWM periods; return the mean torque in each.

        v = kp (i_ref - i) + sum + known e within its limit; the integrator rests while v is at it.
        """
        wanted, emf = np.clip(demand / self.K, -self.I, self.I), self.K * speed
        charge, before, after, index = done = np.empty((4, *emf.shape))
        for k, e in enumerate(emf):
            error = wanted - self._i
            asked = self.kp * error + self._sum + self.known * e
            v = np.clip(asked, -self.most, self.most)
            self._sum = self._sum + self.ki * error * (v == asked)
            m = v / self.winding.V
            index[k], before[k] = np.rint(m / self.least) * self.least if self.least else m, self._i
            after[k], charge[k] = pass_period(self._i, index[k], e, self.winding, self.modulator)
            self._i = after[k]
        self.trace = np.broadcast_to(wanted, emf.shape), charge, before, after, emf, index
        return done[0] * (self.K / self.h)

    def electric(self, trace: Trace, dt: Array) -> Electric:
        """Return currents and voltages of PWM periods."""
        reference, charge, before, after, e, index = trace
        V, R, L = (x[0] for x in self.winding)
        voltage = (R * charge + L * (after - before)) / dt + e
        most = self.most[0] / V * (1 - 1e-9)  # as an index is rounded
        limited = (np.abs(reference) >= self.I[0]) | (np.abs(index) >= most)
        return Electric(reference, charge / dt, voltage, index, limited.astype(np.float64), e)

    def between_edges(self, trace: Trace) -> BetweenEdges:
        """Return current and voltage at the edges of PWM periods, and in the middle between them."""
        _, _, before, _, e, index = trace
        one = Winding(*(np.broadcast_to(x[0], before.shape).ravel() for x in self.winding))
        period = pieces(self.modulator, index.ravel())
        start, _, goal, dt = stretches(before.ravel(), e.ravel(), one, period)
        begins = np.cumsum(dt, axis=0) - dt
        since = np.array([0.0, 0.5, 1.0])[:, None, None] * dt
        current = goal + (start - goal) * np.exp(-since * (one.R / one.L))
        voltage = np.broadcast_to(goal * one.R + e.ravel(), current.shape)
        return BetweenEdges(*(
            np.swapaxes(x, 0, 1).reshape(-1, *before.shape) for x in (begins + since, current, voltage)
        ))  # fmt: skip


class TabulatedPeriods(AbstractCompiledAmplifier):
    """The same periods from a table, in C: while a current keeps its sign, all that a period does is linear in it and the EMF.

    The modulation index is a multiple of `least`, so that few linear functions occur; their coefficients come from three
    passages each.
    """

    signals: ClassVar[int] = 6

    def __init__(self, exact: ExactPeriods) -> None:
        self._exact = exact
        highest = int(np.ceil(1 / exact.least))
        indices = np.arange(-highest, highest + 1, dtype=np.float64) * exact.least
        V, R, L = exact.winding
        cut = pieces(exact.modulator, indices)
        kept = np.exp(-cut.duration[..., None] * (R[0] / L[0]))
        each = [np.broadcast_to(x[..., None], kept.shape) for x in cut]
        # Duration, voltages ahead and behind [bus voltages], and what is kept of the current: (value, piece, joint, 4).
        self._pieces = np.ascontiguousarray(np.stack([*each, kept], axis=-1).swapaxes(0, 1))
        self._linear = np.ascontiguousarray(self._functions(indices))
        table = [*map(pointer, (self._linear, self._pieces)), len(indices), self._linear.shape[-1], len(cut.duration)]
        rows = exact.K, V, R, L, exact.I, exact.kp, exact.ki, exact.most, exact.known, exact.least, highest
        dead, shape = bool(exact.modulator.dead_time), (len(V), V.shape[-1])
        super().__init__("switched_drive", shape, (*rows, dead, 0.0, 0.0), exact.h, objects=Addresses([table] * len(V), self))

    def _functions(self, indices: Array) -> Array:
        """Charge and the currents at edges, (sign, value, joint) -> (constant, by i, by e) x quantity."""
        exact = self._exact
        shape = 2, len(indices), exact.K.shape[-1]
        winding = Winding(*(np.broadcast_to(x[0], shape) for x in exact.winding))
        m = np.broadcast_to(indices[:, None], shape)
        pattern = exact.modulator.pattern(m, np.broadcast_to(np.array([0.0, 1.0])[:, None, None], shape))
        made = []
        for i, e in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)):
            passage, edges = straight(np.full(shape, i), np.full(shape, e), winding, pattern, exact.modulator.period)
            made.append(np.stack([passage.charge, *edges], axis=-1))
        constant, by_i, by_e = made
        return np.stack([constant, by_i - constant, by_e - constant], axis=-2)

    def electric(self, trace: Trace, dt: Array) -> Electric:
        """Return currents and voltages of PWM periods."""
        return self._exact.electric(trace, dt)

    def between_edges(self, trace: Trace) -> BetweenEdges:
        """Return current and voltage at the edges of PWM periods, and in the middle between them."""
        return self._exact.between_edges(trace)
