"""Logs whose times are not uniform, made uniform."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import scipy

from idbench.identify.arrays import Array
from idbench.identify.data.clock import LogClock, torque_stretches
from idbench.identify.data.jumps import Velocities
from idbench.identify.data.log_columns import LogColumns
from idbench.identify.data.motion_log import MotionLog, TorqueChannel
from idbench.identify.errors import LogError, require_positive

MOST_SAMPLES = 1e8  # Samples above which a frequency is taken for a slip
LEAST_VELOCITIES = 50  # Samples from which on logged velocities are compared with differences
FEW = 4  # Rows that an interpolation takes
SHORTEST = 1.0  # Pieces between gaps that are shorter than this [s] are left out
NICE = 2e-3  # Share by which a sampling frequency may be off a round one that is then taken


@dataclass(frozen=True, eq=False)
class Repaired:
    """A log made uniform: one, or several where it has gaps."""

    logs: tuple[MotionLog, ...]
    """Its pieces."""
    clock: LogClock
    """Which rows count, and when they were."""
    velocities: Velocities | None = None
    """What the logged velocities are worth; None without any."""
    short: int = 0
    """How many pieces were too short to be kept."""
    torque_gaps: int = 0
    """How many gaps torques with times of their own have."""

    @classmethod
    def of(cls, columns: LogColumns, torque: TorqueChannel, fs: float | None = None) -> Self:
        """Return a log made uniform at `fs` [Hz], by default at the frequency of its clock.

        Samples of a steady clock stay as they are; what is between others is interpolated.

        Raises
        ------
        LogError
            If too few rows are left, or no piece between gaps is long enough.
        """
        if fs is not None:
            require_positive(fs=fs)
        columns, stretches = torque_stretches(columns)
        clock = LogClock.of(columns)
        sound, fs = replace(columns.rows(clock.kept), t=clock.t), _round(1 / clock.period) if fs is None else fs
        found = list[MotionLog]()
        short = 0
        velocities = None
        parts = _parts(sound, clock, stretches)
        for part in parts:
            if part.t[-1] - part.t[0] < SHORTEST and len(parts) > 1:
                short += 1
                continue
            log, known = _uniform(part, torque, fs)
            found, velocities = [*found, log], velocities or known
        if not found:
            raise LogError(
                f"no piece of {len(parts)} between gaps is longer than {SHORTEST:g} s"
                if parts
                else "times of torques and positions do not overlap: are they of one clock, and in one unit?"
            )
        return cls(tuple(found), clock, velocities, short, max(len(stretches) - 1, 0))

    def words(self, joints: tuple[str, ...]) -> Iterator[str]:
        """Yield what was done, a sentence each."""
        yield from self.clock.words()
        if self.torque_gaps:
            yield f"torques have {self.torque_gaps} gaps of their own: the log is cut there"
        if self.short:
            yield f"{self.short} pieces shorter than {SHORTEST:g} s are left out"
        if self.velocities is not None:
            yield from self.velocities.words(joints)


def resample(t: Array, q: Array, tau: Array, torque: TorqueChannel, fs: float, t_tau: Array | None = None) -> MotionLog:
    """Log at `fs` [Hz] of samples at any increasing times t [s], shape (time,), those of torques being `t_tau` if given.

    Positions q [rad] by a cubic spline; torques tau [N m], shape (time, joint), by straight lines, or, where they are held, by
    the mean of what is held over each new period: the new log's torque is then `averaged`, with the same delay.

    Raises
    ------
    LogError
        If there are fewer than 4 samples, a value is not finite, or times do not increase.
    """
    require_positive(fs=fs)
    own = t if t_tau is None else t_tau
    for times, values in ((t, q), (own, tau)):
        _require_sound(times, values)
    start, end = max(t[0], own[0]), min(t[-1], own[-1])
    count = int((end - start) * fs + 1e-9)
    if not 1 <= count <= MOST_SAMPLES:
        raise LogError(f"fs = {fs:g} Hz makes {count:.3g} samples of {end - start:.3g} s; 1 to {MOST_SAMPLES:.0e} are allowed")
    at = start + np.arange(count + 1) / fs
    positions: Array = np.asarray(scipy.interpolate.CubicSpline(t, q)(at[:-1]), dtype=np.float64)
    if torque.meaning == "held":
        impulse = np.concatenate([np.zeros((1, q.shape[1])), np.cumsum(tau[:-1] * np.diff(own)[:, None], axis=0)])
        grown: Array = np.asarray(
            scipy.interpolate.interp1d(own, impulse, axis=0, fill_value="extrapolate")(at), dtype=np.float64
        )
        return MotionLog(fs, positions, np.diff(grown, axis=0) * fs, replace(torque, meaning="averaged", period=None))
    between = scipy.interpolate.interp1d(own, tau, axis=0)(at[:-1])
    return MotionLog(fs, positions, np.asarray(between, dtype=np.float64), torque)


def _parts(sound: LogColumns, clock: LogClock, stretches: list[tuple[float, float]]) -> list[LogColumns]:
    """Return the pieces between gaps of positions, and of torques that have times of their own."""
    found = []
    for piece in clock.pieces:
        part = sound.rows(piece)
        if part.t_tau is None:
            found.append(part)
            continue
        for start, end in stretches:
            rows, own = (np.flatnonzero((t >= start) & (t <= end)) for t in (part.t, part.t_tau))
            if len(rows) >= FEW and len(own) >= FEW:
                rows = np.arange(max(rows[0] - 1, 0), min(rows[-1] + 2, len(part.t)))
                found.append(replace(part.rows(rows), tau=part.tau[own], t_tau=part.t_tau[own]))
    return found


def _uniform(part: LogColumns, torque: TorqueChannel, fs: float) -> tuple[MotionLog, Velocities | None]:
    """Return a piece without gaps as a log, its positions improved by velocities that are less noisy."""
    steps = np.diff(part.t)
    as_is = part.t_tau is None and np.abs(steps * fs - 1).max() < 1e-3
    log = MotionLog(fs, part.q, part.tau, torque) if as_is else resample(part.t, part.q, part.tau, torque, fs, part.t_tau)
    start = part.t[0] if part.t_tau is None else max(part.t[0], part.t_tau[0])
    at, conditions = start + log.t, part.conditions
    if not as_is:
        conditions = {name: np.stack([np.interp(at, part.t, x) for x in y.T], axis=1) for name, y in conditions.items()}
    log = replace(log, conditions=conditions, missing=part.missing)
    if part.qd is None or not np.isfinite(part.qd).all() or log.samples < LEAST_VELOCITIES:
        return log, None
    qd = part.qd if as_is else scipy.interpolate.CubicSpline(part.t, part.qd)(at)
    velocities = Velocities.of(log.q, qd, fs)
    return replace(log, q=velocities.improved(log.q, qd)), velocities


def _round(fs: float) -> float:
    """Return a frequency, or a round one that is next to it."""
    digits = 10 ** np.floor(np.log10(fs) - 1)
    near = float(np.round(fs / digits) * digits)
    return near if abs(near - fs) <= NICE * fs else fs


def _require_sound(t: Array, values: Array) -> None:
    if len(t) < 4 or not all(np.isfinite(x).all() for x in (t, values)):
        raise LogError(f"{len(t)} samples: at least 4 are needed, without NaN or infinity")
    if (step := np.diff(t)).min() <= 0:
        k = int(np.argmin(step))
        raise LogError(f"time does not increase: t = {t[k]:.9g} s is followed by {t[k + 1]:.9g} s at sample {k + 1}")
