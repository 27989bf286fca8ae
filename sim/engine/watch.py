"""Watching a run while it goes on: what has become final, stretch by stretch."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from idbench.sim.drives.drive import AbstractAmplifier, BetweenEdges, Electric, Trace
from idbench.sim.robot.motors import Array
from idbench.sim.scenario.scenario import Scenario
from idbench.sim.trajectories.trajectory import Reference


@dataclass(frozen=True, eq=False)
class Inner:
    """Signals inside the loop of the first simulation, once for each step of its drive."""

    t: Array
    """When each step begins, on the time of the log [s], shape (step,)."""
    electric: Electric
    """Shape (step, joint) each."""
    tau: Array
    """Mean torque of the motors, ripple included [N m], shape (step, joint)."""
    edges: BetweenEdges | None
    """What happens within the steps, of a drive that chops."""


@dataclass(frozen=True, eq=False)
class WatchedStretch:
    """Samples of the first simulation that have become final; all arrays of shape (time, joint)."""

    first: int
    """Number of the first sample, in the log."""
    reference: Reference
    """The planned motion."""
    measured: Array
    """Positions as the encoders give them [rad]."""
    q: Array
    """True positions [rad]."""
    qd: Array
    """True velocities [rad/s]."""
    tau: Array
    """True mean torque of the motors until the next sample [N m]."""
    command: Array
    """What was commanded: torque [N m] or position [rad]."""
    logged: Array
    """The torque that comes into the log [N m]."""
    electric: Electric | None
    """Means until the next sample; none for a drive without currents."""
    inner: Inner | None
    """What is in the window, if anything is."""
    by_position: bool = False
    """Whether positions are commanded."""
    gap: Array | None = None
    """Position of the rotor minus that of the link [rad], of a robot with backlash."""


@dataclass(frozen=True)
class Watch:
    """Somebody who watches the first simulation of a run. No bit of the run depends on it."""

    receive: Callable[[WatchedStretch], None]
    """Receives every stretch, in order, while the run goes on."""
    every: float = np.inf
    """Length of a stretch [s]; by default the whole run is one."""
    window: tuple[float, float] | None = None
    """From when to when, on the time of the log [s], the signals inside the loop are given at their full rate."""


class Watcher:
    """Collects what the motors do, and hands on what has become final, from sample `skipped` on, where the log begins.

    `h` is the physics step [s]; `logged` gives what the log says of the torques of one stretch after the other, shape
    (1, time, joint).
    """

    def __init__(self, watch: Watch, scenario: Scenario, h: float, skipped: int, logged: Callable[[Array], Array]) -> None:
        fs, self._by_position = scenario.fs, scenario.controller.commanded == "position"
        self._watch = watch
        self._fs = fs
        self._h = h
        self._skipped = skipped
        self._logged = logged
        self._samples = max(1, round(watch.every * fs)) if np.isfinite(watch.every) else np.inf
        self._told, self._rows = skipped, list[Array]()

    def take(self, rows: Array, traces: Sequence[Trace]) -> None:
        """Take in what the motors do: rows as the loop writes them, and the traces of a drive in Python."""
        if traces:
            signals = np.stack([np.concatenate(x) for x in zip(*traces, strict=True)], axis=1)
            rows = np.concatenate([rows, signals.reshape(len(rows), -1)], axis=1)
        self._rows.append(rows)

    @property
    def awaited(self) -> float:
        """Number of samples that complete a stretch."""
        return self._told + self._samples

    def tell(self, final: int, planned: Reference, channels: Mapping[str, Array], drive: AbstractAmplifier) -> None:
        """Hand on the samples up to `final`; `channels` hold all samples, approach included, shape (sample, joint)."""
        if final <= self._told:
            return
        now, per_sample = slice(self._told, final), round(1 / (self._fs * self._h))
        parts: dict[str, Any] = {name: x[now].copy() for name, x in channels.items()}
        parts["tau"] /= per_sample
        parts["logged"] = self._logged(parts["logged"][None])[0]
        each = (x if x.ndim == 2 else x[:, 0] for x in (planned.q[now], planned.qd[now], planned.qdd[now]))
        reference = Reference(self._fs, *each)
        electric, inner = None, None
        every = np.concatenate(self._rows)
        ready = int(np.searchsorted(every[:, 0], final * per_sample))
        self._rows = [every[ready:].copy()]
        if every.shape[1] > 3 + planned.q.shape[-1]:
            rows = _Rows.of(every[:ready], drive, self._h, planned.q.shape[-1])
            electric = rows.means(self._told, final, per_sample)
            inner = rows.inside(self._watch.window, self._h, self._skipped / self._fs, drive) if self._watch.window else None
        parts |= {"electric": electric, "inner": inner}
        self._watch.receive(WatchedStretch(self._told - self._skipped, reference, by_position=self._by_position, **parts))
        self._told = final


@dataclass(frozen=True, eq=False)
class _Rows:
    """Steps of a drive as arrays: when they begin and how long they last, in physics steps, and what happens in them."""

    start: Array
    length: Array
    electric: Electric
    tau: Array
    trace: Trace

    @classmethod
    def of(cls, rows: Array, drive: AbstractAmplifier, h: float, n: int) -> "_Rows":
        """Return rows of the loop: start, length, that of a row of the drive's own, torques, and the drive's signals."""
        trace = tuple(rows[:, 3 + n :].reshape(len(rows), -1, n).swapaxes(0, 1))
        return cls(rows[:, 0], rows[:, 1], drive.electric(trace, rows[:, 2:3] * h), rows[:, 3 : 3 + n], trace)

    def means(self, first: int, final: int, per_sample: int) -> Electric:
        """Return the means over the samples from `first` to before `final`."""
        sample = self.start // per_sample - first
        keep = sample >= 0  # an approach before the log is nobody's
        begins = np.searchsorted(sample[keep], np.arange(final - first))
        weights = (self.length[keep] / per_sample)[:, None]
        return Electric(*(np.add.reduceat(x[keep] * weights, begins, axis=0) for x in self.electric))

    def inside(self, window: tuple[float, float], h: float, before: float, drive: AbstractAmplifier) -> Inner | None:
        """Part within the window [s], None if there is none."""
        t = self.start * h - before
        within = (t > window[0] - h / 2) & (t < window[1] - h / 2)  # half a step aside, where rounding decides nothing
        if not within.any():
            return None
        edges = drive.between_edges(tuple(x[within] for x in self.trace))
        return Inner(t[within], Electric(*(x[within] for x in self.electric)), self.tau[within], edges)
