"""A run in progress: controller, drive and encoder in NumPy around MuJoCo."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import isfinite

import numpy as np
import numpy.typing as npt

from idbench.identify.blame import expect, expect_kind
from idbench.identify.data.motion_log import MotionLog
from idbench.sim.controllers import AbstractLaw, Task
from idbench.sim.drives.drive import AbstractAmplifier, every
from idbench.sim.encoders import AbstractReader
from idbench.sim.engine.clock import Clock, History
from idbench.sim.engine.failures import Failures
from idbench.sim.engine.geared_plant import plant_of
from idbench.sim.engine.run import Run
from idbench.sim.engine.watch import Step, Watcher
from idbench.sim.errors import ScenarioError
from idbench.sim.frictions.friction_law import AbstractContact
from idbench.sim.robot.inverse_dynamics import InverseDynamics
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.scenario.measurement import CurrentSensor
from idbench.sim.scenario.scenario import Scenario
from idbench.sim.trajectories import Reference

NOISE = 2  # Stream of random numbers of the torque's noise

BLOCK = 1e-3
"""Time [s] over which the motion of the rotors may be predicted, for back-EMF and ripple: with a jerk of 1000 rad/s^3 they are
then off by 2e-7 rad and 5e-4 rad/s."""


class Bench:
    """A run in progress: controller, drive and encoder around a plant."""

    def __init__(  # noqa: PLR0913  # the last by its name
        self,
        scenario: Scenario,
        robot: Robot,
        planned: Reference,
        seeds: tuple[int, ...],
        vary: Mapping[str, npt.ArrayLike],
        threads: int,
        watcher: Watcher | None = None,
        *,
        informed: bool = False,
    ) -> None:
        fs = scenario.fs
        n = robot.n
        nsim = len(seeds)
        samples = len(planned.q)
        self._scenario = scenario
        self._planned = planned
        self._seeds = seeds
        self._watcher = watcher
        self._h = scenario.drive.step_length(fs, scenario.physics.step)
        self._clock = clock = Clock(round(1 / fs / self._h), self._h, scenario.timing.delay)
        self._plant = plant_of(scenario, robot, nsim, self._h, vary, threads)
        self._plant.put(planned.q[0])
        task = Task(scenario.nominal_robot, planned, nsim, vary if informed else {})
        self._law = expect_kind(scenario.controller, "start", scenario.controller.start(task), AbstractLaw)
        self._drive = expect_kind(scenario.drive, "start", scenario.drive.start(robot, nsim, self._h), AbstractAmplifier)
        self._cogging, self._commutation = scenario.ripple.start(robot)
        self._smooth = scenario.ripple.steady
        friction, encoder = scenario.friction, scenario.encoder
        contact = friction.start(self._plant.joints, self._plant.Fs, self._h)
        self._friction = expect_kind(friction, "start", contact, AbstractContact)
        self._encoder = expect_kind(encoder, "start", encoder.start(n, samples, fs, generators(seeds, 0)), AbstractReader)
        self._each = nsim, n
        self._sensor = CurrentSensor(scenario.torque, nsim, n)
        self._jitter = self._drawn_jitter(samples) if scenario.timing.jitter or scenario.timing.refresh else None
        self._history = History(
            clock.late + clock.per_sample + int(np.ceil(scenario.timing.refresh / self._h)), nsim, n, self._h
        )
        self._failures = Failures(robot, planned, seeds)
        self._going: npt.NDArray[np.intp] | None = None
        self._at_rest = every(planned.q[0], nsim) if planned.q.ndim == 2 else planned.q[0]
        self._before = self._command = self._demand = _holding(scenario, robot, self._at_rest, vary)
        self._qd = np.zeros((nsim, n))
        self._steps = 1
        self._instants = dict[int, tuple[Array, Array]]()
        self._steady = scenario.drive.steady and self._smooth
        self._most = self._longest()
        self._measured, self._commands, self._currents, self._q, self._speeds, self._tau = np.zeros((6, samples, nsim, n))
        self._gaps = np.zeros((samples, nsim, n)) if self._plant.has_play else np.zeros(0)
        self.steps = samples * clock.per_sample + clock.late

    def _longest(self) -> int:
        """Return over how many physics steps the motion of the rotors may be predicted at most."""
        scenario = self._scenario
        watched = scenario.timing.jitter or scenario.timing.refresh or scenario.torque.source == "current"
        if watched or not scenario.friction.steady:
            return 1
        return self._clock.per_sample if self._steady else max(1, round(BLOCK / self._h))

    def _drawn_jitter(self, samples: int) -> Array:
        """Offset of each sample from its claimed instant, or its age, shape (sample, nsim) [steps]."""
        width = self._scenario.timing.jitter / self._h
        if width >= self._clock.per_sample:
            raise ScenarioError(
                f"timing.jitter = {self._scenario.timing.jitter:g} s must be below 1/fs = {1 / self._scenario.fs:g} s"
            )
        if width / 2 > self._clock.late:
            raise ScenarioError(
                f"timing.jitter = {self._scenario.timing.jitter:g} s needs a timing.delay of at least its half in whole "
                f"physics steps of {self._h:g} s: a command cannot act before its sample is taken"
            )
        sources = generators(self._seeds, 1)
        off = np.stack([width * (rng.random(samples) - 0.5) for rng in sources], axis=1)
        if (period := self._scenario.timing.refresh / self._h) == 0:
            return off
        instants = np.arange(samples)[:, None] * self._clock.per_sample + off
        return off - (instants - period * np.array([rng.random() for rng in sources])) % period

    def advance(self, step: int) -> int:
        """Advance from physics step `step` to where something may change; return how many steps that were."""
        q, qd = self._plant.q, self._plant.qd
        sample = self._clock.sample(step)
        if sample is not None:
            self._stop_failed(step)
        if sample is not None and sample < len(self._q):
            self._q[sample] = q
            self._speeds[sample] = qd
            self._currents[sample] = self._sensor.value
            if self._plant.has_play:
                self._gaps[sample] = self._plant.rotors[0] - q
            if self._watcher and self._watcher.due(self._final(step)):
                self.tell(step)
        rotor_q, rotor_qd = self._plant.rotors
        before_gear = self._scenario.drive.before_gear
        self._history.put(step, *((rotor_q, rotor_qd) if before_gear else (q, qd)))
        steps = self._listen(step)
        t, half_square = self._middles(steps)
        rate = (rotor_qd - self._qd) / (self._steps * self._h)  # accelerating as in the steps before
        mid_qd, mid_q = rotor_qd + rate * t, rotor_q + rotor_qd * t + rate * half_square
        self._qd, self._steps = rotor_qd.copy(), steps
        constant = None if self._smooth else 1 + self._commutation.at(mid_q)
        apart = self._plant.has_play and not before_gear
        self._drive.sees(mid_q + (q - rotor_q) + (qd - rotor_qd) * t if apart else mid_q)
        electric = self._drive.step(self._demand, mid_qd if constant is None else mid_qd * constant, steps)
        expect(self._drive, "step", electric, (1, *self._each), (steps, *self._each))
        self._sensor.take(electric, steps * self._h)
        tau = electric if constant is None else electric * constant + self._cogging.at(mid_q)
        self._friction.driven(tau[0])
        resistance = self._friction.torque(mid_qd[0])
        expect(self._friction, "torque", np.asarray(resistance), (), self._each)
        total = tau + resistance
        if not isfinite(np.add.reduce(total, axis=None)):
            self._stop_failed(step)
            self._failures.finite({"the controller": self._demand, "the drive": tau, "the friction": resistance})
            self._stop_failed(step)
        if self._watcher:
            self._watcher.take(Step(step, steps, tau, self._drive.trace))
        self._plant.step(total, steps, self._going)
        current = step // self._clock.per_sample
        if current < len(self._tau):
            self._tau[current] += tau[0] if len(tau) == 1 == steps else np.add.reduce(tau) / len(tau) * steps
        return steps

    def _final(self, step: int) -> int:
        """Number of samples that are final at the beginning of physics step `step`."""
        clock, samples = self._clock, len(self._q)
        return min(samples, step // clock.per_sample, max(0, (step - clock.late - 1) // clock.per_sample + 1))

    def tell(self, step: int) -> None:
        """Hand on to the watcher what is final at the beginning of physics step `step`, of the first simulation."""
        if self._watcher:
            channels = {
                "measured": self._measured,
                "q": self._q,
                "qd": self._speeds,
                "tau": self._tau,
                "command": self._commands,
                "logged": self._currents if self._scenario.torque.source == "current" else self._commands,
            }
            if self._plant.has_play:
                channels["gap"] = self._gaps
            self._watcher.tell(self._final(step), self._planned, channels, self._drive)

    def _middles(self, steps: int) -> tuple[Array, Array]:
        """Return the middle t of each step to come [s], shape (steps, 1, 1), or of all for steady parts, and t^2 / 2."""
        if steps not in self._instants:
            count = 1 if self._steady else steps
            t = np.linspace(0.5, count - 0.5, count)[:, None, None] * (steps / count * self._h)
            self._instants[steps] = t, t**2 / 2
        return self._instants[steps]

    def _listen(self, step: int) -> int:
        """Let the command whose turn it is act; return for how many steps nothing changes."""
        clock, (k, after) = self._clock, self._clock.command(step)
        if after == 0 and k >= 0:
            taken = step - clock.late
            then = self._history.whole(taken) if self._jitter is None else self._history.at(taken + self._jitter[k])
            q = self._encoder.read(k, then)
            expect(self._encoder, "read", q, self._each)
            self._before, self._command = self._command, expect(self._law, "command", self._law.command(k, q), self._each)
            self._measured[k], self._commands[k] = q, self._command
            self._demand = self._command if clock.old == 0 else clock.old * self._before + (1 - clock.old) * self._command
        elif after == 1:
            self._demand = self._command
        if after == 0 and (self._steady or clock.old > 0):
            return 1  # the current of a new command settles in a step of its own, and so does a mixture of two
        return min(clock.undisturbed(step), self._most)

    @property
    def failures(self) -> Mapping[int, str]:
        """Why simulations have failed, by their number."""
        return self._failures.reasons

    def run(self, skipped: int) -> Run:
        """Records since sample `skipped`."""
        channels = self._measured, self._commands, self._currents, self._q, self._speeds, self._tau / self._clock.per_sample
        measured, command, current, q, qd, tau = (np.swapaxes(x[skipped:], 0, 1) for x in channels)
        for sim in np.flatnonzero(~np.isfinite(command).all(axis=(1, 2))):
            self._failures.add(int(sim), "the controller commands no finite torque")
        for failed in self._failures.reasons:
            measured[failed] = command[failed] = current[failed] = 0.0
        scenario, n = self._scenario, q.shape[-1]
        logged = scenario.torque.logged(
            current if scenario.torque.source == "current" else command, n, generators(self._seeds, NOISE)
        )
        planned = replace(self._planned, **{x: getattr(self._planned, x)[skipped:] for x in ("q", "qd", "qdd")})
        t = (skipped + np.arange(q.shape[1])) / scenario.fs
        conditions = scenario.friction.conditions(t, n) | scenario.drive.conditions(t, command)
        log = MotionLog(scenario.fs, measured, logged, scenario.channel, conditions)
        return Run(scenario, self._seeds, self._plant.robots, planned, log, q, qd, tau, command, self._failures.reasons)

    def _stop_failed(self, step: int) -> None:
        """Leave simulations at rest that cannot go on."""
        plant, failures = self._plant, self._failures
        failures.look(step / self._clock.per_sample, plant.q, plant.qd)
        for sim, complaint in plant.troubles.items():
            failures.add(sim, f"MuJoCo cannot go on: {complaint}")
        if failures.reasons:
            failed = list(failures.reasons)
            plant.put(self._at_rest[failed], np.array(failed))
            self._going = np.setdiff1d(np.arange(len(self._seeds)), failed)


def _holding(scenario: Scenario, robot: Robot, at_rest: Array, vary: Mapping[str, npt.ArrayLike]) -> Array:
    """Return the command that holds robots at rest, shape (nsim, joint): positions, or their gravity torques [N m]."""
    if scenario.controller.commanded == "position":
        return at_rest.copy()
    still = np.zeros_like(at_rest)
    return InverseDynamics(robot, len(at_rest), vary)(at_rest, still, still)


def generators(seeds: Sequence[int], stream: int) -> list[np.random.Generator]:
    """Return a generator for each simulation, that depends on its seed and the purpose alone."""
    return [np.random.default_rng([seed, stream]) for seed in seeds]
