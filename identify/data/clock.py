"""The clock of a log: which rows are repeats, whether its stamps or a steady clock are right, and where it has gaps."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Self

import numpy as np
import numpy.typing as npt
import scipy

from idbench.identify.arrays import TINY, Array
from idbench.identify.data.log_columns import LogColumns
from idbench.identify.errors import LogError

LONGEST = 0.05  # Time [s] without a row beyond which a log is cut: what a robot does meanwhile nobody knows
STEADY = 0.01  # Departure of a time step from the mean step, as a share of it, up to which stamps are as good as a steady clock

ROUGHER = 0.95
"""Share of a clock's roughness that another must leave less than to be believed: stamps first, then a steady clock."""

MIN_ROWS = 20  # Rows that it takes


@dataclass(frozen=True, eq=False)
class LogClock:
    """The rows of a log that count, and their times."""

    kept: npt.NDArray[np.intp]
    """Which rows of the log these are, shape (row,)."""
    t: Array
    """Their times [s], shape (row,)."""
    repeated: int
    """Rows left out because they repeat the row before while the robot moves."""
    backward: int
    """Rows left out because their time does not increase."""
    broken: int
    """Rows left out because they have a NaN or an infinity."""
    word: str
    """Which clock is right: "stamps", "steady" (a sample every period, some never logged) or "rows" (a sample a row)."""
    jitter: float
    """Rms of the stamps about the clock [s]."""
    roughness: dict[str, float]
    """Of the positions at the times of each clock, relative to that at the stamps."""

    @classmethod
    def of(cls, columns: LogColumns) -> Self:
        """Return the clock of a log.

        Three clocks are tried on the positions: the stamps; a steady clock of the stamps' period, of which some samples are
        missing; one with a sample a row, as a recorder has that is faster than what it records. Positions are smooth: at
        wrong times they are not. What an interpolation of the neighbours (Lagrange, two to each side) leaves is their
        roughness. The stamps are believed unless another clock leaves less.
        """
        finite = np.isfinite(columns.q).all(axis=1) & np.isfinite(columns.t)
        if columns.t_tau is None:
            finite &= np.isfinite(columns.tau).all(axis=1)
        rows = np.flatnonzero(finite)
        broken = len(finite) - len(rows)
        t = columns.t
        forward = t[rows] > np.maximum.accumulate(np.concatenate([[-np.inf], t[rows][:-1]]))
        if len(rows) >= MIN_ROWS and np.mean(~forward) > 0.5:
            raise LogError("time hardly ever increases: is its column the right one?")
        backward, rows = int(np.count_nonzero(~forward)), rows[forward]
        _require_enough(rows, finite)
        fresh = _fresh(columns, rows)
        repeated, rows = int(np.count_nonzero(~fresh)), rows[fresh]
        _require_enough(rows, finite)
        clocks = dict(_clocks(t[rows]))
        rough = {word: _roughness(times, columns.q[rows]) for word, times in clocks.items()}
        word = next(word for word, left in rough.items() if ROUGHER * left <= min(rough.values()))
        relative = {name: value / max(rough["stamps"], TINY) for name, value in rough.items()}
        steady = clocks.get("steady", t[rows]) if word == "stamps" else clocks[word]
        jitter = float(np.std(steady - t[rows]))
        return cls(rows, clocks[word], repeated, backward, broken, word, jitter, relative)

    @property
    def period(self) -> float:
        """The sampling period [s]: of most rows."""
        return float(np.median(np.diff(self.t)))

    @property
    def filled(self) -> int:
        """Samples within pieces that were never logged, or left out."""
        period, steps = self.period, np.diff(self.t)
        within = steps[(steps > 1.5 * period) & (steps <= self.longest)]
        return int(np.sum(np.rint(within / period) - 1))

    @property
    def longest(self) -> float:
        """Time without a row beyond which the log is cut [s]."""
        return max(LONGEST, 3.5 * self.period)

    @property
    def gaps(self) -> list[tuple[float, float]]:
        """Beginning and length of the gaps at which the log is cut [s]."""
        steps = np.diff(self.t)
        return [(float(self.t[k]), float(steps[k])) for k in np.flatnonzero(steps > self.longest)]

    @property
    def pieces(self) -> list[slice]:
        """The rows between the gaps."""
        ends = [0, *(np.flatnonzero(np.diff(self.t) > self.longest) + 1), len(self.t)]
        return [slice(int(a), int(b)) for a, b in pairwise(ends)]

    @property
    def uniform(self) -> bool:
        """Whether every sample of a steady clock is there."""
        steps = np.diff(self.t)
        return bool(np.abs(steps - steps.mean()).max() <= STEADY * steps.mean())

    def words(self) -> Iterator[str]:
        """Yield what was done, a sentence each."""
        every = len(self.kept) + self.repeated + self.backward + self.broken
        for count, what in (
            (self.repeated, "repeat the row before while the robot moves"),
            (self.backward, "have a time that does not increase"),
            (self.broken, "have no value somewhere"),
        ):
            if count:
                yield f"{count} of {every} rows ({100 * count / every:.2g} %) {what}: left out"
        if self.word == "steady":
            yield (
                f"stamps jitter by {1e3 * self.jitter:.2g} ms about a steady clock of {1 / self.period:.5g} Hz, at which "
                f"positions are {1 / max(self.roughness['steady'], TINY):.2g} times smoother: its times are taken"
            )
        if self.word == "rows":
            yield (
                f"rows come at {1 / self.period:.5g} Hz, whatever their stamps say: positions are "
                f"{1 / max(self.roughness['rows'], TINY):.2g} times smoother so"
            )
        if self.filled:
            yield f"samples never logged, or left out: {self.filled}, filled in by their neighbours; held torques are averaged"
        for start, length in self.gaps:
            yield f"nothing was logged for {length:.3g} s after t = {start:.4g} s: the log is cut there"


def _require_enough(rows: npt.NDArray[np.intp], every: npt.NDArray[np.bool_]) -> None:
    if len(rows) < MIN_ROWS:
        raise LogError(f"{len(rows)} rows are left of {len(every)}, without those that repeat others or have no value: too few")


def torque_stretches(columns: LogColumns) -> tuple[LogColumns, list[tuple[float, float]]]:
    """Return columns whose torques, with times of their own, have values and increasing times, and where they have no gap."""
    t, tau = columns.t_tau, columns.tau
    if t is None:
        return columns, []
    sound = np.isfinite(t) & np.isfinite(tau).all(axis=1)
    t, tau = t[sound], tau[sound]
    forward = t > np.maximum.accumulate(np.concatenate([[-np.inf], t[:-1]]))
    t, tau = t[forward], tau[forward]
    if len(t) < MIN_ROWS:
        raise LogError(f"{len(t)} torques have values and times that increase: too few")
    steps = np.diff(t)
    ends = [0, *(np.flatnonzero(steps > max(LONGEST, 3.5 * float(np.median(steps)))) + 1), len(t)]
    return replace(columns, t_tau=t, tau=tau), [(float(t[a]), float(t[b - 1])) for a, b in pairwise(ends)]


def _fresh(columns: LogColumns, rows: npt.NDArray[np.intp]) -> npt.NDArray[np.bool_]:
    """Mask of rows that do not repeat the one before; where the robot stands, repeats are no fault.

    Positions alone repeat wherever their encoder is coarse: they say nothing.
    """
    if columns.t_tau is not None and columns.qd is None:
        return np.ones(len(rows), dtype=bool)
    parts = [columns.q, *([] if columns.t_tau is not None else [columns.tau]), *([] if columns.qd is None else [columns.qd])]
    whole = np.concatenate(parts, axis=1)[rows]
    same = np.concatenate([[False], (np.diff(whole, axis=0) == 0).all(axis=1)])
    starts = np.flatnonzero(~same)
    lengths = np.diff(np.append(starts, len(same)))
    t = columns.t[rows]
    lasts = np.minimum(starts + lengths, len(t) - 1)
    standing = t[lasts] - t[starts] > LONGEST
    return ~(same & ~np.repeat(standing, lengths))


def _clocks(t: Array) -> Iterator[tuple[str, Array]]:
    """Yield the clocks that the rows may have."""
    yield "stamps", t
    steps = np.diff(t)
    period = float(np.median(steps))
    if np.abs(steps - period).max() <= STEADY * period:
        return
    k = _numbered(t, 1 / period)
    slope, start = np.polyfit(k, t, 1)
    if slope > 0 and np.abs(t - start - slope * k).max() < LONGEST:
        yield "steady", start + slope * k
    if not (steps > LONGEST).any():
        yield "rows", np.linspace(t[0], t[-1], len(t))


def _numbered(t: Array, fs: float) -> Array:
    """Return the samples of a steady clock that stamps are of, one a row, shape (row,); its frequency is near `fs` [Hz].

    The frequency at which all stamps have the same phase, |sum of exp(2 pi i f t)| being largest, is looked for in a short
    beginning first, then in ever longer ones, each of which tells it more sharply.
    """
    since = t - t[0]
    count = min(10 * MIN_ROWS, len(t))
    width = 0.1 * fs
    while True:
        some = since[:count]
        tried = fs + np.linspace(-width, width, 161)
        fs = float(tried[np.argmax([abs(np.exp(2j * np.pi * f * some).sum()) for f in tried])])
        if count == len(t):
            break
        width, count = 1 / max(float(some[-1]), 1e-9), min(3 * count, len(t))
    phase = np.angle(np.exp(2j * np.pi * fs * since).sum()) / (2 * np.pi)
    order = np.arange(len(t))
    # A sample later at least from row to row: what was lost before a row only grows.
    lost = scipy.optimize.isotonic_regression(fs * since - phase - order).x
    return np.asarray(order + np.round(lost), dtype=np.float64)


def _roughness(t: Array, q: Array) -> float:
    """Deviation of positions from the interpolation of their neighbours, all joints alike; without the worst of the rows.

    Rows at which the neighbours lie further apart than usual say little, and are left out.
    """
    around = [np.roll(t, shift)[2:-2] for shift in (2, 1, -1, -2)]
    here, weights = t[2:-2], []
    for i, own in enumerate(around):
        others = [other for j, other in enumerate(around) if j != i]
        weights.append(np.prod([(here - other) / (own - other) for other in others], axis=0))
    made = sum(w[:, None] * np.roll(q, shift, axis=0)[2:-2] for w, shift in zip(weights, (2, 1, -1, -2), strict=True))
    left = (q[2:-2] - made) / np.sqrt(1 + np.sum(np.square(weights), axis=0))[:, None]
    usual = np.median(around[3] - around[0])
    left = left[(around[3] - around[0]) < 2 * usual]
    scale = np.maximum(np.ptp(q, axis=0), 1e-9)
    return float(np.sqrt(np.mean(np.quantile((left / scale) ** 2, 0.98, axis=0)))) if len(left) else np.inf
