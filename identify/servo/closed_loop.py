"""Servos in closed loop, simulated from commands alone: many runs and many sets of parameters at once."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
import numpy.typing as npt

from identify.arrays import Array
from identify.servo.friction import budget
from identify.servo.run import ServoRun
from identify.servo.servo import Servo

LARGEST = 2**24
"""Positions that one piece of a simulation keeps: lanes beyond follow in pieces of their own."""

FRICTION = ("Fs", "Fst", "vs", "Fl", "Fls", "Fle", "Flm", "Flq", "Fgd", "Fgb")

WAY = 6
"""Ranges of its motion that a joint may cross in a step: beyond, it is lost, and numbers would overflow."""


@final
@dataclass(frozen=True, eq=False)
class _Grid:
    """Inputs at the steps of the simulation, shape (step, run), or (1, run) where they do not change."""

    command: Array
    drive: Array
    inertia: Array
    sine: Array
    cosine: Array
    rest: Array


@final
class ServoLoop:
    """Runs of one kind of servo, to be simulated with any parameters.

    Leapfrog: speeds in the middle of steps, positions at their ends; damping is implicit, so that the result is of second
    order in the step. Friction takes speed away, and at most all of it: joints stick.

    Parameters
    ----------
    servo : Servo
        What is known.
    runs : sequence of ServoRun
        What was logged.
    step : float
        Longest step [s].
    """

    def __init__(self, servo: Servo, runs: Sequence[ServoRun], step: float = 2e-3) -> None:
        self.servo, self.runs = servo, tuple(runs)
        typical = float(np.median([run.T for run in self.runs]))
        self.h = h = typical / np.ceil(typical / step - 1e-9)
        self.samples = max(len(run.t) for run in self.runs)
        self.steps = int(np.ceil(max(run.t[-1] - run.t[0] for run in self.runs) / h)) + 2
        self._kp = np.array([run.kp for run in self.runs])
        self._grid = self._inputs()
        x = np.stack([_padded((run.t - run.t[0]) / h, self.samples) for run in self.runs])
        self._before = np.minimum(x.astype(np.int64), self.steps - 2)
        self._share = x - self._before
        self.q = np.stack([_padded(run.q, self.samples) for run in self.runs])
        self.kept = np.arange(self.samples) < np.array([[len(run.t)] for run in self.runs])
        self._q0 = np.array([np.median(run.q[:3]) for run in self.runs])
        self._qd0 = np.array([_speed(run) for run in self.runs])
        self._range = float(np.ptp(self.q[self.kept])) + float(np.ptp(self._grid.command)) + 1e-6

    def _inputs(self) -> _Grid:
        t = np.arange(self.steps) * self.h
        places = [np.maximum(np.searchsorted(run.t - run.t[0], t + 1e-9, side="right") - 1, 0) for run in self.runs]
        command = np.stack([run.command[i] for run, i in zip(self.runs, places, strict=True)], axis=1)
        V = self.servo.supply
        drive = np.stack(
            [run.enabled[i] * (V if run.voltage is None else run.voltage[i]) for run, i in zip(self.runs, places, strict=True)],
            axis=1,
        )
        loads = (self._of_load(name, t) for name in ("inertia", "sine", "cosine", "rest"))
        return _Grid(command, _short(drive), *loads)

    def _of_load(self, name: str, t: Array) -> Array:
        values = [getattr(run.load, name) for run in self.runs]
        if all(x.ndim == 0 for x in values):
            return np.array(values)[None]
        every = [np.broadcast_to(x, run.t.shape) for x, run in zip(values, self.runs, strict=True)]
        return np.stack([np.interp(t, run.t - run.t[0], x) for run, x in zip(self.runs, every, strict=True)], axis=1)

    def simulate(self, p: Mapping[str, npt.ArrayLike]) -> Array:
        """Return positions at the samples of the log [rad], shape (lane, run, sample), for a value of each parameter a lane."""
        lanes = max(np.size(x) for x in p.values())
        every = {name: np.broadcast_to(np.asarray(x, dtype=np.float64), (lanes,)) for name, x in p.items()}
        size = max(1, LARGEST // (self.steps * len(self.runs)))
        pieces = [{name: x[i : i + size, None] for name, x in every.items()} for i in range(0, lanes, size)]
        return np.concatenate([self._at_samples(self._piece(piece)) for piece in pieces])

    def _at_samples(self, q: Array) -> Array:
        """Return positions between steps, linearly, shape (lane, run, sample)."""
        run = np.arange(len(self.runs))[:, None]
        lower, upper = q[self._before, :, run], q[self._before + 1, :, run]
        return np.moveaxis(lower + (upper - lower) * self._share[..., None], -1, 0)

    def _piece(self, p: Mapping[str, Array]) -> Array:
        """Return positions at all steps as they are logged, shape (step, lane, run)."""
        h, grid, n = self.h, self._grid, len(self.runs)
        lanes = len(p["a"])
        late, share = np.divmod(p["delay"][:, 0] / h + 0.5, 1.0)
        late, share = late.astype(np.int64), share[:, None]
        rate, offset = p.get("rate", np.full((lanes, 1), np.inf)) * h, p["offset"]
        motion = _Motion(self, p, n)
        # A force acts for the step about its instant: means of the target over steps can be delayed by parts of them.
        kept, lane = int(late.max()) + 2, np.arange(lanes)
        means = np.repeat(np.repeat(grid.command[:1], lanes, axis=0)[None], kept, axis=0)
        target = means[0].copy()
        out = np.empty((self.steps, lanes, n))
        for i in range(self.steps):
            out[i] = motion.q
            move = np.minimum(np.maximum(grid.command[i] - target, -rate), rate)
            means[i % kept] = target + move * (1 - np.abs(move) / (2 * rate))
            target = target + move
            now, past = (means[(i - late - k) % kept, lane] for k in (0, 1))
            motion.advance(i, now + (past - now) * share)
        return out - offset


class _Motion:
    """The state of the joints of all lanes and runs: angle of the file and speed, shape (lane, run)."""

    def __init__(self, loop: ServoLoop, p: Mapping[str, Array], n: int) -> None:
        self._p, self._grid, self._h, servo = p, loop._grid, loop.h, loop.servo
        self.q = loop._q0 + p["offset"] + np.zeros((len(p["a"]), n))
        self._qd = loop._qd0 + np.zeros_like(self.q)
        self._friction = {name: p[name] for name in FRICTION if name in p}
        self._gain, self._limit = servo.gain * loop._kp, servo.duty_limit
        self._lead, self._band = p.get("lead"), p.get("dead_band")
        self._geared, self._upright = "Fgd" in p, bool(self._grid.cosine.any())
        self._most = WAY * loop._range / loop.h

    def advance(self, i: int, target: Array) -> None:
        """Advance by a step with the target of the firmware, an angle of the log."""
        p, h, g = self._p, self._h, self._grid
        V, J, sine, cosine, rest = (x[i if len(x) > 1 else 0] for x in (g.drive, g.inertia, g.sine, g.cosine, g.rest))
        error = target - (self.q - p["offset"])
        if self._lead is not None:
            error = error - self._lead * self._qd
        if self._band is not None:
            error = error - np.minimum(np.maximum(error, -self._band), self._band)
        duty = np.minimum(np.maximum(self._gain * error, -self._limit), self._limit)
        damping = p["b"] * (V > 0)
        push = p["a"] * V * duty
        external = -(sine * np.sin(self.q) + rest)
        if self._upright:
            external = external - cosine * np.cos(self.q)
        whole = J + p["Ia"]
        motor = push - damping * self._qd
        half = h / 2 * (damping + p["Fv"]) / whole
        free = ((1 - half) * self._qd + h / whole * (push + external)) / (1 + half)
        transmitted = np.sign(free) * (J * motor - p["Ia"] * external) / whole if self._geared else motor
        most = h / whole / (1 + half) * budget(self._friction, self._qd, motor, external, transmitted)
        speed = free - np.minimum(np.maximum(free, -most), most)
        self._qd = np.minimum(np.maximum(speed, -self._most), self._most)
        self.q = self.q + h * self._qd


def _padded(x: Array, length: int) -> Array:
    return np.concatenate([x, np.full(length - len(x), x[-1])])


def _short(x: Array) -> Array:
    """Return one row where all are the same."""
    return x[:1] if (x == x[:1]).all() else x


def _speed(run: ServoRun) -> float:
    """Return the speed at the beginning, from the first samples; 0 if they differ by no more than two counts do."""
    slope = np.polyfit(run.t[:7] - run.t[0], run.q[:7], 1)[0]
    spread = np.ptp(run.q[:7])
    distinct = np.unique(run.q[:7])
    return float(slope) if len(distinct) > 3 and spread > 0 else 0.0
