"""Servos in closed loop, simulated from commands alone: many runs and many sets of parameters at once."""

from collections.abc import Mapping, Sequence
from typing import final

import numpy as np
import numpy.typing as npt

from identify.arrays import Array
from identify.servo.motion import GearedMotion, Inputs, Motion, Start
from identify.servo.run import ServoRun
from identify.servo.servo import Servo

LARGEST = 2**24
"""Positions that one piece of a simulation keeps: lanes beyond follow in pieces of their own."""


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
        needed = np.array([np.ceil((run.t[-1] - run.t[0]) / h) + 2 for run in self.runs])
        self._order = order = np.argsort(
            -needed, kind="stable"
        )  # longest first: at any step those that go on are the first ones
        self._place = np.argsort(order, kind="stable")
        self._going = (needed > np.arange(self.steps)[:, None]).sum(axis=1)
        ordered = [self.runs[k] for k in order]
        self._given = self._read(ordered)
        rests = np.array([np.median(run.q[:3]) for run in ordered]), np.array([_speed(run) for run in ordered])
        x = np.stack([_padded((run.t - run.t[0]) / h, self.samples) for run in self.runs])
        self._before = np.minimum(x.astype(np.int64), self.steps - 2)
        self._share = x - self._before
        self.q = np.stack([_padded(run.q, self.samples) for run in self.runs])
        self.kept = np.arange(self.samples) < np.array([[len(run.t)] for run in self.runs])
        range_ = float(np.ptp(self.q[self.kept])) + float(np.ptp(self._given.command)) + 1e-6
        self._start = Start(*rests, np.array([run.kp for run in ordered]), range_)

    def _read(self, runs: Sequence[ServoRun]) -> Inputs:
        t = np.arange(self.steps) * self.h
        places = [np.maximum(np.searchsorted(run.t - run.t[0], t + 1e-9, side="right") - 1, 0) for run in runs]
        command = np.stack([run.command[i] for run, i in zip(runs, places, strict=True)], axis=1)
        on = np.stack([run.enabled[i].astype(np.float64) for run, i in zip(runs, places, strict=True)], axis=1)
        V = [
            np.full(self.steps, self.servo.supply) if run.voltage is None else run.voltage[i]
            for run, i in zip(runs, places, strict=True)
        ]
        drive = np.stack(V, axis=1) * on
        loads = (_of_load(runs, name, t) for name in ("inertia", "sine", "cosine", "rest"))
        return Inputs(command, _short(_centred(drive)), _short(_centred(on)), *loads)

    def simulate(self, p: Mapping[str, npt.ArrayLike], ahead: npt.ArrayLike = 0.0) -> Array:
        """Return positions at the samples of the log [rad], shape (lane, run, sample), for a value of each parameter a lane.

        `ahead`, shape (lane, run) or less, is where runs begin, beyond the position that was measured [rad].
        """
        lanes = max(np.size(x) for x in p.values())
        every = {name: np.broadcast_to(np.asarray(x, dtype=np.float64), (lanes,)) for name, x in p.items()}
        size = max(1, LARGEST // (self.steps * len(self.runs)))
        begin = np.broadcast_to(np.asarray(ahead, dtype=np.float64), (lanes, len(self.runs)))[:, self._order]
        pieces = [slice(i, i + size) for i in range(0, lanes, size)]
        parts = (self._piece({name: x[now, None] for name, x in every.items()}, begin[now]) for now in pieces)
        return np.concatenate([self._at_samples(q) for q in parts])

    def _motion(self, p: Mapping[str, Array], ahead: Array) -> Motion:
        kind = GearedMotion if np.any(p.get("backlash", 0.0)) else Motion
        return kind(self.servo, self._given, p, self.h, self._start._replace(q=self._start.q + ahead))

    def _at_samples(self, q: Array) -> Array:
        """Return positions between steps, linearly, shape (lane, run, sample)."""
        run = self._place[:, None]
        lower, upper = q[self._before, :, run], q[self._before + 1, :, run]
        return np.moveaxis(lower + (upper - lower) * self._share[..., None], -1, 0)

    def _piece(self, p: Mapping[str, Array], ahead: Array) -> Array:
        """Return positions at all steps as they are logged, shape (step, lane, run)."""
        h, grid, n = self.h, self._given, len(self.runs)
        lanes = len(p["a"])
        late, share = np.divmod(p["delay"][:, 0] / h + 0.5, 1.0)
        late, share = late.astype(np.int64), share[:, None]
        rate, offset = p.get("rate", np.full((lanes, 1), np.inf)) * h, p["offset"]
        motion = self._motion(p, ahead)
        # A force acts for the step about its instant: means of the target over steps can be delayed by parts of them.
        kept, lane = int(late.max()) + 2, np.arange(lanes)
        means = np.repeat(np.repeat(grid.command[:1], lanes, axis=0)[None], kept, axis=0)
        target = means[0].copy()
        out = np.zeros((self.steps, lanes, n))
        for i, going in enumerate(self._going.tolist()):
            if going < n:
                n = going
                motion.keep(n)
                means, target = means[..., :n].copy(), target[:, :n].copy()
            out[i, :, :n] = motion.q
            move = np.minimum(np.maximum(grid.command[i, :n] - target, -rate), rate)
            means[i % kept] = target + move * (1 - np.abs(move) / (2 * rate))
            target = target + move
            now, past = (means[(i - late - k) % kept, lane] for k in (0, 1))
            motion.advance(i, now + (past - now) * share)
        return out - offset


def _of_load(runs: Sequence[ServoRun], name: str, t: Array) -> Array:
    values = [getattr(run.load, name) for run in runs]
    if all(x.ndim == 0 for x in values):
        return np.array(values)[None]
    every = [np.broadcast_to(x, run.t.shape) for x, run in zip(values, runs, strict=True)]
    return np.stack([np.interp(t, run.t - run.t[0], x) for run, x in zip(runs, every, strict=True)], axis=1)


def _padded(x: Array, length: int) -> Array:
    return np.concatenate([x, np.full(length - len(x), x[-1])])


def _centred(x: Array) -> Array:
    """Return the means of held values over the steps about their instants, in which forces act."""
    return np.concatenate([x[:1], (x[1:] + x[:-1]) / 2])


def _short(x: Array) -> Array:
    """Return one row where all are the same."""
    return x[:1] if (x == x[:1]).all() else x


def _speed(run: ServoRun) -> float:
    """Return the speed at the beginning, from the first samples; 0 if they differ by no more than two counts do."""
    slope = np.polyfit(run.t[:7] - run.t[0], run.q[:7], 1)[0]
    spread = np.ptp(run.q[:7])
    distinct = np.unique(run.q[:7])
    return float(slope) if len(distinct) > 3 and spread > 0 else 0.0
