"""Servos in closed loop, simulated from commands alone: many runs and many sets of parameters at once."""

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from ctypes import c_double, c_int64, c_void_p
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from idbench.identify.arrays import TINY, Array
from idbench.identify.compiled import function, pointer
from idbench.identify.servo.parameters import SERVO_PARAMETERS, ServoLaw
from idbench.identify.servo.run import ServoRun

IN_COUNTS = 0.1  # How far from a whole count a position may be written, as a share of it, and still be one

SLOPE = 5.0
"""Sampling times that one count of error in a slope through seven samples takes to be a count: sqrt(sum (k - 3)^2) = 5.3."""

STATES = 3  # Of the beginning of a run: position, speed, target


class Begin(NamedTuple):
    """How a run begins."""

    state: Array
    """Position [rad], speed [rad/s], and by how much the target is ahead of the command [rad], shape (3,)."""
    per_angle: Array
    """How far each is off where a position is off by 1 rad, shape (3,): a speed by the noise of a slope, the target by as much
    as the joint is away from its command, since nobody knows where it was before the log."""


WAY = 6  # Ranges of its motion that a joint may cross in a step: beyond, it is lost, and numbers would overflow


class ServoLoop:
    """Runs of one kind of servo, to be simulated with any parameters (see servo.c beside this).

    Steps are at most `step` [s]. Positions at rest are rounded to multiples of `count` [rad], as the servo reports them; 0:
    none are (see `count_of`).
    """

    def __init__(self, runs: Sequence[ServoRun], step: float, count: float = 0.0) -> None:
        self.runs = tuple(runs)
        self.count = count
        typical = float(np.median([run.T for run in self.runs]))
        self.h = typical / np.ceil(typical / step - 1e-9)
        self.samples = max(len(run.t) for run in self.runs)
        self.q = self.stacked([run.clean for run in self.runs])
        self.kept = np.stack([np.pad(run.read_well, (0, self.samples - len(run.t))) for run in self.runs])
        self.step = max(run.step for run in self.runs)
        self._begin = [initial_state(run) for run in self.runs]
        commands = np.concatenate([run.command for run in self.runs])
        self._fastest = WAY * (float(np.ptp(self.q[self.kept])) + float(np.ptp(commands)) + 1e-6) / self.h
        self._tracks = [self._track(run) for run in self.runs]

    def stacked(self, signals: Sequence[Array]) -> Array:
        """Signals of the runs, shape (run, sample), each with its last value after its end."""
        return np.stack([np.pad(x, (0, self.samples - len(x)), mode="edge") for x in signals])

    def limits(self, names: Sequence[str]) -> Array:
        """Smallest and largest values of parameters, shape (2, p), those of the offset by the ranges of the joint."""
        limits = np.array([[SERVO_PARAMETERS[name].low, SERVO_PARAMETERS[name].high] for name in names]).reshape(-1, 2).T
        if "offset" in names:
            low, high = zip(*(run.offsets for run in self.runs), strict=True)
            k = list(names).index("offset")
            limits[:, k] = max(limits[0, k], *low), min(limits[1, k], *high)
        return limits

    def simulate(self, p: Mapping[str, npt.ArrayLike], ahead: npt.ArrayLike = 0.0) -> Array:
        """Positions at the samples of the log [rad], shape (lane, run, sample), for a value of each parameter a lane.

        `ahead`, shape (lane, run, 3) or less, is how runs begin beside what was measured (see `Begin`) [rad].
        """
        lanes = max(np.size(x) for x in p.values())
        every = {name: np.broadcast_to(np.asarray(x, dtype=np.float64), (lanes,)).tolist() for name, x in p.items()}
        laws = np.array([ServoLaw(**{name: x[lane] for name, x in every.items()}) for lane in range(lanes)])
        begins = np.broadcast_to(np.asarray(ahead, dtype=np.float64), (lanes, len(self.runs), STATES))
        out = np.empty((lanes, *self.q.shape))
        with ThreadPoolExecutor(os.cpu_count()) as pool:  # compiled code runs beside Python
            list(pool.map(lambda k: self._simulate_run(k, laws, begins[:, k], out[:, k]), range(len(self.runs))))
        return out

    def _simulate_run(self, k: int, laws: Array, ahead: Array, out: Array) -> None:
        """Write the positions of a run into `out`, shape (lane, sample)."""
        run, begin, track = self.runs[k], self._begin[k], self._tracks[k]
        servo, n = run.servo, len(track[0])
        starts = np.ascontiguousarray(begin.state + ahead * begin.per_angle)
        steps = (run.t - run.t[0]) / self.h
        before = steps.astype(np.int64)  # each sample
        firmware = np.array([servo.slope, servo.kd, servo.limit, servo.speed_limit, servo.count, *servo.steps])
        signals = np.array([pointer(x) for x in track], dtype=np.uint64)
        lanes = np.array([pointer(lane) for lane in out], dtype=np.uint64)
        share, work = steps - before, np.empty(2 * n)
        moved = *map(pointer, (firmware, signals)), n, self.h, self._fastest, *map(pointer, (before, share)), len(before)
        _lanes()(pointer(laws), pointer(starts), len(laws), *moved, self.count, pointer(work), pointer(lanes))
        out[:, len(before) :] = out[:, len(before) - 1 : len(before)]

    def _track(self, run: ServoRun) -> tuple[Array, ...]:
        """Command, voltage, share of the step with torque on, and load at each step, in the order of servo.c."""
        t = np.arange(int(np.ceil((run.t[-1] - run.t[0]) / self.h)) + 2) * self.h
        place = np.maximum(np.searchsorted(run.t - run.t[0], t + 1e-9, side="right") - 1, 0)
        on = run.enabled[place].astype(np.float64)
        voltage = np.full(len(t), run.servo.supply) if run.voltage is None else run.voltage[place]
        forward = np.zeros(len(t)) if run.forward is None else run.forward[place]
        load = run.load.over(np.minimum(run.t[0] + t, run.t[-1]))
        signals = run.command[place], forward, _centred(voltage * on), _centred(on), *load
        return tuple(np.ascontiguousarray(x, dtype=np.float64) for x in signals)


@cache
def _lanes() -> Any:
    """Compiled simulation of many laws of a run."""
    P, I, D = c_void_p, c_int64, c_double  # noqa: E741
    return function("servo_lanes", P, P, I, P, P, I, D, D, P, P, I, D, P, P)


def targets(command: Array, rate: float, h: float) -> Array:
    """Mean over each step h [s] of what follows a command within a rate [rad/s]."""
    command = np.ascontiguousarray(command, dtype=np.float64)
    means = np.empty_like(command)
    run = function("servo_targets", c_void_p, c_int64, *[c_double] * 4, c_void_p)
    run(pointer(command), len(command), rate, h, 0.0, 0.0, pointer(means))
    return means


def count_of(runs: Sequence[ServoRun]) -> float:
    """Angle of a count [rad] if nearly all positions are whole counts, else 0, as where they were filtered.

    A joint stops where the firmware sees the next count. There, errors of rounding are not noise: all have one direction.
    """
    if not (count := max(run.servo.count for run in runs)):
        return 0.0
    x = np.concatenate([run.q / run.servo.count for run in runs if run.servo.count])
    return count if np.mean(np.abs(x - np.rint(x)) < IN_COUNTS) > 1 - IN_COUNTS else 0.0


def _centred(x: Array) -> Array:
    """Means of held values over the steps about their instants, in which forces act."""
    return np.concatenate([x[:1], (x[1:] + x[:-1]) / 2])


def initial_state(run: ServoRun) -> Begin:
    """Initial state of a run, from its first samples; at rest if they differ by two counts at most."""
    if run.step:
        t, q = run.t[:7] - run.t[0], run.clean[:7]
        at = float(np.median(q[:3]))
        if len(np.unique(q)) <= 3:
            return Begin(np.array([at, 0.0, 0.0]), np.array([1.0, 0.0, 0.0]))
        speed, per_speed = float(np.polyfit(t, q, 1)[0]), 1 / (SLOPE * run.T)
    else:
        t, q = run.t[:3] - run.t[0], run.clean[:3]
        at, per_speed = float(q[0]), 2 / run.T
        speed = float(np.polyfit(t, q, 2)[1])
    away = abs(float(run.command[0]) - at) / max(run.still, TINY)
    return Begin(np.array([at, speed, 0.0]), np.array([1.0, per_speed, 1.0 + away]))
