"""The rows that mistakes would leave unexplained: columns through mask and operator, as those of parameters."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.basis.basis import Basis
from idbench.identify.basis.newton_euler import torques
from idbench.identify.estimators.log_rows import LogRows, split_by_log
from idbench.identify.judge import mistakes
from idbench.identify.judge.fitted_motion import FittedMotion
from idbench.identify.judge.mistake_columns import Rows
from idbench.identify.judge.mistakes import Mistake
from idbench.identify.judge.ripples import WAVES, likely_waves
from idbench.identify.judge.stretches import held_torque
from idbench.identify.signals.signals import State

RATE = 10.0  # Instants at which columns are made, in multiples of the operator's cut-off: they are smooth where rows count
USUAL = 5.0  # Cut-off of an operator that states none [Hz]
AT_ONCE = 2_000_000  # Values of columns that are filtered at once: some 16 MB
INSTANTS = 12  # Instants from which on something may have changed: a twelfth of a log apart
PUSH = 0.3  # Time [s] that a collision takes, about: a robot that hits something stops, or gives way
SLOWEST = 0.5  # Least frequency [Hz] at which a base is taken to move by itself

LINE = 12.0
"""A spectral line of the residuals is this many times their median: of 1000 frequencies one is so by chance in 200 logs."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """A mistake that may have been made, and its rows."""

    mistake: Mistake
    """Which."""
    joint: int | None
    """Of which joint, from 0; None if it is the whole robot's."""
    plain: Array
    """Its columns, as the rows are, shape (r, g)."""
    white: Array
    """The same, made independent."""
    instant: float | None = None
    """When it happened, or from when on it is there [s]."""

    @property
    def key(self) -> tuple[str, int | None]:
        """Its cause, and joint."""
        return self.mistake.cause, self.joint


@dataclass(frozen=True, eq=False)
class MistakeRows:
    """The rows of mistakes at an estimate."""

    parts: Sequence[LogRows]
    """Rows of each log."""
    basis: Basis
    """The robot."""
    X: Array
    """The estimate, shape (p,)."""

    def every(self) -> list[Candidate]:
        """Return the mistakes of joints and of the robot, and those that are looked for from an instant on."""
        joints, of_joints = range(self.basis.n), [m for m in mistakes.OF_JOINTS if m is not mistakes.GAIN]
        asked = [(m, j) for m in of_joints for j in (self.basis.hinges if m is mistakes.ECCENTRIC else joints)]
        found = [*self._gains(), *self._made([*asked, *((m, None) for m in (*mistakes.OF_ROBOT, *mistakes.FROM_AN_INSTANT))])]
        slips = [replace(c, mistake=c.mistake._replace(cause="slip")) for c in found if c.mistake.cause == "zero"]
        held = [c for c in found if c.mistake in mistakes.FROM_AN_INSTANT]
        steady = [c for c in found if c.mistake not in mistakes.FROM_AN_INSTANT]
        return [*steady, *(late for c in (*slips, *held) for late in self._from_instants(c))]

    def of_robot(self, mistake: Mistake) -> Iterator[Candidate]:
        """Yield a mistake of the whole robot; none where it has no columns."""
        yield from self._made([(mistake, None)])

    def _gains(self) -> Iterator[Candidate]:
        """Yield torques that are too large beside others, from rows of what is predicted: parameters leave little of them."""
        held = held_torque(self.parts)
        predicted = np.concatenate([part.rows.predicted(self.X) for part in self.parts]) + held
        measured = np.concatenate([part.rows.Y for part in self.parts]) + held
        group = np.concatenate([part.rows.group for part in self.parts])
        driven = [j for j in range(self.basis.n) if np.any(measured[group == j])]
        for j in driven if len(driven) > 1 else ():
            yield self._candidate(mistakes.GAIN, j, np.where(group == j, predicted, 0.0)[:, None])

    def pushed(self, e: Array) -> Iterator[Candidate]:
        """Yield a collision of each joint where its residuals e, shape (r,), are largest for so long."""
        time, step = self._time, self._step
        width = max(2, round(PUSH / step))
        kinds = self.parts[0].rows.kinds
        by_kind = e.reshape(-1, kinds).T
        for j, x in enumerate(by_kind):
            sums = np.abs(np.convolve(x, np.ones(width), "same"))
            k = int(sums.argmax())
            inside = np.zeros((len(x), kinds))
            inside[max(0, k - width // 2) : k - width // 2 + width, j] = 1.0
            yield self._candidate(mistakes.COLLISION, j, inside.reshape(-1, 1), float(time[k * kinds]))

    def shaken(self, e: Array) -> Iterator[Candidate]:
        """Yield motions of the base, along each axis, at the highest line in the spectrum of residuals e, shape (r,)."""
        kinds, step = self.parts[0].rows.kinds, self._step
        power = np.sum(np.abs(np.fft.rfft(e.reshape(-1, kinds), axis=0)) ** 2, axis=1)
        f = np.fft.rfftfreq(len(e) // kinds, step)
        some = f > SLOWEST
        if not some.any() or power[some].max() < LINE * np.median(power[some]):
            return
        line = 2 * np.pi * f[some][power[some].argmax()] * self._time
        for c in self._made([(m, None) for m in mistakes.BASE]):
            yield self._candidate(c.mistake, None, c.plain * np.stack([np.sin(line), np.cos(line)], axis=-1))

    def rippled(self, e: Array) -> Iterator[Candidate]:
        """Yield ripples of hinges, of the waves that residuals e, shape (r,), have most of."""
        if self.parts[0].signals.log.poses:
            return
        ones = [np.ones_like(x) for x in self._torques]
        for mistake, sizes in (mistakes.COGGING, ones), (mistakes.COMMUTATION, self._torques):
            for j, k in likely_waves(self.parts, e, sizes, self._cutoff, self.basis.hinges):
                plain = np.concatenate([_wave(part, j, k, x[j]) for part, x in zip(self.parts, sizes, strict=True)])
                yield self._candidate(mistake._replace(setting=float(k)), j, plain)

    @cached_property
    def _torques(self) -> list[Array]:
        """Predicted torques of each log at its samples, shape (joint, time)."""
        return [torques(self.basis, part.signals.state, self.X) for part in self.parts]

    @property
    def looks(self) -> int:
        """How many collisions, motions of the base and ripples are looked for."""
        kinds, count = self.parts[0].rows.kinds, len(self._time)
        return count + 3 * count // (2 * kinds) + 2 * len(self.basis.hinges) * len(WAVES)

    @property
    def _cutoff(self) -> float:
        return self.parts[0].problem.own_chain.cutoff or USUAL

    @property
    def _step(self) -> float:
        to_rows = self.parts[0].rows.maps[0]
        return to_rows.grid.step / to_rows.signals.fs

    @property
    def _time(self) -> Array:
        """Times of the rows [s], shape (r,), those of several logs one after the other."""
        ends = np.cumsum([0.0, *(part.rows.time[-1] for part in self.parts)])
        return np.concatenate([part.rows.time + end for part, end in zip(self.parts, ends, strict=False)])

    def most(self, candidate: Candidate) -> float:
        """Return the size above which a mistake is not small."""
        most = candidate.mistake.most
        return most * self._reach if candidate.mistake.cause == "length" else most

    @cached_property
    def _reach(self) -> float:
        return FittedMotion(self.basis, self.X, self.parts[0].signals.state, np.zeros(1)).reach

    def place(self, instant: float | None) -> tuple[float | None, int | None]:
        """Return an instant of `_time` as one of its log [s], and which of several that is, from 0."""
        if instant is None or len(self.parts) == 1:
            return instant, None
        ends = np.cumsum([0.0, *(part.rows.time[-1] for part in self.parts)])
        k = int(np.clip(np.searchsorted(ends, instant) - 1, 0, len(self.parts) - 1))
        return instant - float(ends[k]), k

    def _from_instants(self, c: Candidate) -> Iterator[Candidate]:
        time = self._time
        for instant in np.linspace(time[0], time[-1], INSTANTS + 1)[1:-1]:
            yield self._candidate(c.mistake, c.joint, c.plain * (time > instant)[:, None], float(instant))

    def _candidate(self, mistake: Mistake, joint: int | None, plain: Array, instant: float | None = None) -> Candidate:
        each = zip(self.parts, split_by_log(plain, self.parts), strict=True)
        return Candidate(mistake, joint, plain, np.concatenate([part.whitening.whiten(x) for part, x in each]), instant)

    def _made(self, asked: Sequence[tuple[Mistake, int | None]]) -> Iterator[Candidate]:
        """Yield mistakes with their rows, those that have as many columns in every log."""
        of_parts = [self._of_part(part, asked) for part in self.parts]
        for (mistake, joint), *each in zip(asked, *of_parts, strict=True):
            if any(np.any(x) for columns in each for x in columns):
                yield self._candidate(mistake, joint, np.concatenate([np.stack(columns, axis=-1) for columns in each]))

    def _motion(self, part: LogRows) -> tuple[FittedMotion, int]:
        """Return the fitted motion of a log at some of its samples, one of how many."""
        thin = max(1, int(part.signals.fs / (RATE * self._cutoff)))
        state = part.signals.state
        q, qd, qdd = (np.ascontiguousarray(x[..., ::thin]) for x in (state.q, state.qd, state.qdd))
        conditions = {name: x[..., ::thin] for name, x in state.conditions.items()}
        t = np.arange(q.shape[-1]) * thin / part.signals.fs
        return FittedMotion(self.basis, self.X, State(q, qd, lambda _: qdd, conditions), t, part.signals.log.poses), thin

    def _of_part(self, part: LogRows, asked: Iterable[tuple[Mistake, int | None]]) -> list[list[Array]]:
        """Return the rows of each column of mistakes."""
        motion, thin = self._motion(part)
        columns = [each if isinstance(each := m.columns(motion, j or 0), tuple) else (each,) for m, j in asked]
        made = _filtered(part, [rows for each in columns for rows in each], motion.t, thin)
        return [[next(made) for _ in each] for each in columns]


def _wave(part: LogRows, j: int, k: int, size: Array) -> Array:
    """Return the rows of sine and cosine of k waves a turn in the torque of a joint, shape (r, 2)."""
    to_rows, q = part.rows.maps[0], part.signals.state.q[j]
    wave = to_rows.kernel.apply(to_rows.inside[j] * size * np.stack([np.sin(k * q), np.cos(k * q)]))
    found = np.zeros((len(part.rows.time), 2))
    found[part.rows.group == j] = (to_rows.outside[j] * wave).T
    return found


def _filtered(part: LogRows, columns: Sequence[Rows], t: Array, thin: int) -> Iterator[Array]:
    """Yield the rows of torques at some instants."""
    to_rows, log = part.rows.maps[0], part.signals.log
    every = np.arange(log.samples) / part.signals.fs
    at_once = max(1, AT_ONCE // (log.n * log.samples))
    for begin in range(0, len(columns), at_once):
        some = columns[begin : begin + at_once]
        whole = np.zeros((len(some), log.n, log.samples))
        for i, rows in enumerate(some):
            for j, x in rows.items():
                whole[i, j] = x if thin == 1 else np.interp(every, t, x)
        yield from to_rows.measurement(whole)
