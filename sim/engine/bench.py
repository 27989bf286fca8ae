"""A run in progress: a compiled loop for each simulation, and what Python does where a part is its own."""

import ctypes
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from idbench.identify.blame import expect, expect_kind
from idbench.identify.compiled import function, pointer
from idbench.identify.data.motion_log import MotionLog
from idbench.sim.controllers import AbstractLaw, Task
from idbench.sim.drives.drive import AbstractAmplifier, AbstractCompiledAmplifier
from idbench.sim.encoders import AbstractReader
from idbench.sim.engine import loop as c
from idbench.sim.engine.clock import Clock
from idbench.sim.engine.failures import ADVICE, Bounds
from idbench.sim.engine.loop import CHANNELS, Loop, series
from idbench.sim.engine.plant import Plant
from idbench.sim.engine.run import Run
from idbench.sim.engine.watch import Watcher
from idbench.sim.errors import ScenarioError
from idbench.sim.frictions.friction_law import AbstractContact
from idbench.sim.part import AbstractCompiledPart, Part
from idbench.sim.robot.inverse_dynamics import InverseDynamics
from idbench.sim.robot.motors import Array
from idbench.sim.robot.payload import with_play
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.varied import VariedRobots, varied_models
from idbench.sim.scenario.scenario import Scenario
from idbench.sim.trajectories import Reference

NOISE = 2  # Stream of random numbers of the torque's noise

BLOCK = 1e-3
"""Time [s] over which the motion of the rotors may be predicted, for back-EMF and ripple: with a jerk of 1000 rad/s^3 they are
then off by 2e-7 rad and 5e-4 rad/s."""


class Bench:
    """A run in progress: controller, drive and encoder around a plant."""

    def __init__(  # the last by its name
        self,
        scenario: Scenario,
        robot: Robot,
        planned: Reference,
        seeds: tuple[int, ...],
        vary: Mapping[str, npt.ArrayLike],
        watcher: Watcher | None = None,
        *,
        informed: bool = False,
    ) -> None:
        fs, n, nsim, samples = scenario.fs, robot.n, len(seeds), len(planned.q)
        self._scenario, self._planned, self._seeds, self._watcher = scenario, planned, seeds, watcher
        h = self._h = scenario.drive.step_length(fs, scenario.physics.step)
        self.clock = clock = Clock(round(1 / fs / h), h, scenario.timing.delay)
        self._bounds = Bounds(robot, planned, nsim)
        self.robots, self._plant = _plant(scenario, robot, vary, self._bounds, h)
        self._plant.put(planned.q[0])
        task = Task(scenario.nominal_robot, planned, nsim, vary if informed else {})
        self._law = expect_kind(scenario.controller, "start", scenario.controller.start(task), AbstractLaw)
        self._drive = expect_kind(scenario.drive, "start", scenario.drive.start(robot, nsim, h), AbstractAmplifier)
        self._ripples = scenario.ripple.start(robot)
        friction, encoder = scenario.friction, scenario.encoder
        contact = friction.start(self._plant, self._plant.Fs, h)
        self._friction = expect_kind(friction, "start", contact, AbstractContact)
        self._encoder = expect_kind(encoder, "start", encoder.start(n, samples, fs, generators(seeds, 0)), AbstractReader)
        self._plant.after_friction()
        self.failures = dict[int, str]()
        self._most = self._longest()
        self.numbers = self._plant.numbers
        self.numbers[:, c.BEFORE_STEPS] = 1
        self._now, self._rows = np.zeros((nsim, c.RESISTANCE + 1, n)), np.zeros((nsim, c.TOTAL + 1, self._most, n))
        self._now[:, [c.BEFORE, c.COMMANDED, c.DEMAND]] = _holding(scenario, robot, planned, nsim, vary)[:, None]
        self._records = np.zeros((nsim, len(CHANNELS), samples, n))
        self._traces = list[tuple[Array, ...]]()
        self._loops = self._looped(samples)
        self.steps = samples * clock.per_sample + clock.late

    def _longest(self) -> int:
        """Return over how many physics steps the motion of the rotors may be predicted at most."""
        scenario = self._scenario
        watched = scenario.timing.jitter or scenario.timing.refresh or scenario.torque.source == "current"
        if watched or not scenario.friction.steady:
            return 1
        steady = scenario.drive.steady and scenario.ripple.steady
        return self.clock.per_sample if steady else max(1, round(BLOCK / self._h))

    def _looped(self, samples: int) -> Any:
        """Return the loops, at their beginning."""
        scenario, clock, n, drive = self._scenario, self.clock, self._plant.n, self._drive
        smooth, timing = scenario.ripple.steady, scenario.timing
        signals = drive.signals if isinstance(drive, AbstractCompiledAmplifier) else 0
        reach = clock.late + clock.per_sample + int(np.ceil(timing.refresh / self._h)) + 2
        offsets = self._drawn_jitter(samples) if timing.jitter or timing.refresh else None
        self._kept = kept = np.zeros((2, len(self._seeds), reach, n)), offsets, np.zeros((self._most, signals, n))
        kinds, cutoff = (scenario.drive.steady and smooth, smooth, scenario.drive.before_gear), scenario.torque.cutoff
        whole = samples, clock.per_sample, clock.late, self._most, *kinds, signals, reach
        numbers = *whole, clock.old, self._h, 2 * np.pi * cutoff if cutoff else np.inf
        self._series = [series(ripple) for ripple in self._ripples]
        every = self._encoder, self._law, drive, self._friction
        parts = [x.parts if isinstance(x, AbstractCompiledPart) else None for x in every]
        python = self._python = Part(None, n)
        loops = (Loop * len(self._seeds))()
        for i, loop in enumerate(loops):
            own = [None if offsets is None else offsets[i], *kept[0][:, i], self._now[i], self._rows[i], self._records[i]]
            pointers = [*map(pointer, own), pointer(kept[2]), None]
            each = [ctypes.pointer(python if x is None else x[i]) for x in parts]
            loop.__init__(self._plant.bodies[i], *numbers, *each, *(x for x, _ in self._series), *pointers)
        return loops

    def _drawn_jitter(self, samples: int) -> Array:
        """Offset of each sample from its claimed instant, or its age, shape (nsim, sample) [steps]."""
        width, per_sample = self._scenario.timing.jitter / self._h, self.clock.per_sample
        if width >= per_sample:
            raise ScenarioError(
                f"timing.jitter = {self._scenario.timing.jitter:g} s must be below 1/fs = {1 / self._scenario.fs:g} s"
            )
        if width / 2 > self.clock.late:
            raise ScenarioError(
                f"timing.jitter = {self._scenario.timing.jitter:g} s needs a timing.delay of at least its half in whole "
                f"physics steps of {self._h:g} s: a command cannot act before its sample is taken"
            )
        sources = generators(self._seeds, 1)
        off = np.stack([width * (rng.random(samples) - 0.5) for rng in sources])
        if (period := self._scenario.timing.refresh / self._h) == 0:
            return off
        instants = np.arange(samples) * per_sample + off
        return off - (instants - period * np.array([[rng.random()] for rng in sources])) % period

    def advance(self, until: int, shares: Any) -> None:
        """Advance to before physics step `until`; `shares` calls a function with shares of simulations."""
        watcher, run = self._watcher, function("run_loops", ctypes.c_void_p, *[ctypes.c_int64] * 2, result=ctypes.c_int64)
        if watcher:
            rows = until - int(self.numbers[0, c.STEP]) + self._most
            trace = np.empty((rows, 3 + (1 + self._loops[0].signals) * self._plant.n))
            self._loops[0].trace, self.numbers[0, c.TRACED] = pointer(trace), 0
        while stops := shares(lambda first, count: run(ctypes.addressof(self._loops[first]), count, until)):
            self._count_failed()
            if not any(stops):
                break
            {c.READ: self._read, c.COMMAND: self._order, c.DRIVE: self._drive_on, c.RESIST: self._resist}[max(stops)]()
        if watcher:
            watcher.take(trace[: self.numbers[0, c.TRACED]], self._traces)
            self._traces = []

    def _read(self) -> None:
        q = self._encoder.read(self._sample, self._now[:, c.THEN].copy())
        self._now[:, c.MEASURED] = expect(self._encoder, "read", q, self._each)

    def _order(self) -> None:
        u = self._law.command(self._sample, self._now[:, c.MEASURED].copy())
        self._now[:, c.COMMANDED] = expect(self._law, "command", u, self._each)

    def _drive_on(self) -> None:
        steps, rows = self.numbers[self._going, [[c.STEPS], [c.ROWS]]][:, 0].tolist()
        demand = self._now[:, c.DEMAND].copy()
        seen, speed = self._rows[:, [c.SEEN, c.TURNING], :rows].transpose(1, 2, 0, 3).copy()
        self._drive.sees(seen)
        electric = self._drive.step(demand, speed, steps)
        expect(self._drive, "step", electric, (1, *self._each), (steps, *self._each))
        self._rows[:, c.ELECTRIC, : len(electric)] = electric.swapaxes(0, 1)
        self.numbers[:, c.TORQUES] = len(electric)
        if self._watcher and self._drive.trace:
            rows = len(electric) if self._scenario.ripple.steady else max(rows, len(electric))
            each = (x[0][None] if x.ndim == 2 else x[:, 0] for x in self._drive.trace)
            self._traces.append(tuple(np.repeat(x, rows // len(x), axis=0) for x in each))

    def _resist(self) -> None:
        self._plant.before_friction()
        self._friction.driven(self._rows[:, c.TAU, 0].copy())
        resistance = self._friction.torque(self._rows[:, c.MIDDLE_QD, 0].copy())
        self._now[:, c.RESISTANCE] = expect(self._friction, "torque", np.asarray(resistance), (), self._each)
        self._plant.after_friction()

    @property
    def _going(self) -> int:
        """A simulation that goes on: all of them are at the same place."""
        return int(np.argmin(self.numbers[:, c.STATE] != 0))

    @property
    def _sample(self) -> int:
        return int(self.numbers[self._going, c.SAMPLE])

    @property
    def _each(self) -> tuple[int, int]:
        return len(self._seeds), self._plant.n

    def _count_failed(self) -> None:
        """Say why simulations cannot go on that have stopped; MuJoCo keeps their last state."""
        for sim in np.flatnonzero(self.numbers[:, c.STATE]).tolist():
            if sim in self.failures:
                continue
            plant, t = self._plant, self.numbers[sim, c.STEP] * self._h
            why, advice = self._bounds.broken(sim, plant.q[sim], plant.qd[sim]), f": {ADVICE}"
            why = f"{why} {t:.3g} s after the start" if why else ""
            if not why and (trouble := plant.trouble(sim)):
                why, advice = f"MuJoCo cannot go on: {trouble}", ""
            if not why:
                why, advice = f"{self._broken_part(sim)} gives no finite torque", ""
            self.failures[sim] = f"{why} (seed {self._seeds[sim]}){advice}"

    def _broken_part(self, sim: int) -> str:
        """The first part whose torque has no size."""
        rows = self._rows[sim, c.TAU, : self.numbers[sim, c.ROWS]]
        torques = {"the controller": self._now[sim, c.DEMAND], "the drive": rows, "the friction": self._now[sim, c.RESISTANCE]}
        return next((part for part, torque in torques.items() if not np.isfinite(torque).all()), "the friction")

    def next_stop(self, step: int) -> int:
        """Physics step up to which to advance from another: a hundredth of the run, or what somebody who watches waits for."""
        clock, samples = self.clock, self._records.shape[2]
        k = step // clock.per_sample + -(-samples // 100)
        if self._watcher:
            while k > step // clock.per_sample + 1 and clock.final((k - 1) * clock.per_sample) >= self._watcher.awaited:
                k -= 1
        return self.steps if k >= samples else k * clock.per_sample

    def tell(self, *, ended: bool = False) -> None:
        """Hand on to the watcher a stretch of the first simulation, if it is complete, or will not be."""
        final = min(self._records.shape[2], self.clock.final(int(self.numbers[0, c.STEP])))
        if self._watcher and (ended or final >= self._watcher.awaited):
            channels = {name: self._records[0, CHANNELS.index(name)] for name in ("measured", "q", "qd", "tau", "command")}
            channels["logged"] = self._records[0, CHANNELS.index(self._scenario.torque.recorded)]
            if self._plant.stride == 2:
                channels["gap"] = self._records[0, CHANNELS.index("gap")]
            self._watcher.tell(final, self._planned, channels, self._drive)

    def run(self, skipped: int) -> Run:
        """Records since sample `skipped`."""
        for sim in np.flatnonzero(~np.isfinite(self._records[:, CHANNELS.index("command")]).all(axis=(1, 2))).tolist():
            self.failures.setdefault(sim, f"the controller commands no finite torque (seed {self._seeds[sim]})")
        self._records[list(self.failures), : CHANNELS.index("q")] = 0.0
        scenario, records = self._scenario, dict(zip(CHANNELS, self._records[:, :, skipped:].swapaxes(0, 1), strict=True))
        command, n = records["command"], self._plant.n
        logged = scenario.torque.logged(records[scenario.torque.recorded], n, generators(self._seeds, NOISE))
        planned = replace(self._planned, **{x: getattr(self._planned, x)[skipped:] for x in ("q", "qd", "qdd")})
        t = (skipped + np.arange(command.shape[1])) / scenario.fs
        conditions = scenario.friction.conditions(t, n) | scenario.drive.conditions(t, command)
        log = MotionLog(scenario.fs, records["measured"], logged, scenario.channel, conditions)
        truth = records["q"], records["qd"], records["tau"] / self.clock.per_sample, command
        return Run(scenario, self._seeds, self.robots, planned, log, *truth, self.failures)


def _plant(
    scenario: Scenario, robot: Robot, vary: Mapping[str, npt.ArrayLike], bounds: Bounds, h: float
) -> tuple[Sequence[Robot], Plant]:
    """Return the robots of the simulations, and their bodies, of two hinges a joint where the drive has play."""
    nsim, play = len(bounds.box[0]), scenario.drive.play(robot)
    robots = VariedRobots(robot, nsim, vary) if vary else (robot,) * nsim
    if not play.any():
        return robots, Plant(varied_models(robot, nsim, vary), scenario.physics, h, bounds)
    if vary:
        raise ScenarioError(f"a robot with backlash has the parameters of its file: {', '.join(vary)} cannot vary")
    edits = scenario.payload.edit, scenario.friction.edit, scenario.drive.edit, partial(with_play, play=play, h=h)
    model = Robot.load(scenario.robot, *edits).model
    return robots, Plant([model] * nsim, scenario.physics, h, bounds, 2)


def _holding(scenario: Scenario, robot: Robot, planned: Reference, nsim: int, vary: Mapping[str, npt.ArrayLike]) -> Array:
    """Return the command that holds robots at rest, shape (nsim, joint): positions, or their gravity torques [N m]."""
    at_rest = np.array(np.broadcast_to(planned.q[0], (nsim, robot.n)))
    if scenario.controller.commanded == "position":
        return at_rest
    still = np.zeros_like(at_rest)
    return InverseDynamics(robot, nsim, vary)(at_rest, still, still)


def generators(seeds: Sequence[int], stream: int) -> list[np.random.Generator]:
    """Return a generator for each simulation, that depends on its seed and the purpose alone."""
    return [np.random.default_rng([seed, stream]) for seed in seeds]
