"""Watching a run while it goes on: what has become final, stretch by stretch."""

from bisect import bisect_left
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

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


class Step(NamedTuple):
    """What the motors did from a physics step on."""

    step: int
    """The first."""

    steps: int
    """How many there are."""

    tau: Array
    """Torque of the motors [N m], shape (steps or 1, nsim, joint)."""

    trace: Trace
    """What their drive did."""


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
        self._told, self._taken = skipped, list[Step]()

    def take(self, step: Step) -> None:
        """Take in what the motors do."""
        self._taken.append(step)

    def due(self, final: int) -> bool:
        """True if a stretch is complete when `final` samples are."""
        return final - self._told >= self._samples

    def tell(self, final: int, planned: Reference, channels: Mapping[str, Array], drive: AbstractAmplifier) -> None:
        """Hand on the samples up to `final`; `channels` hold all samples, approach included, shape (sample, nsim, joint)."""
        if final <= self._told:
            return
        now, per_sample = slice(self._told, final), round(1 / (self._fs * self._h))
        parts: dict[str, Any] = {name: x[now, 0].copy() for name, x in channels.items()}
        parts["tau"] /= per_sample
        parts["logged"] = self._logged(parts["logged"][None])[0]
        reference = Reference(self._fs, *(_alone(getattr(planned, x)[now]) for x in ("q", "qd", "qdd")))
        ready = bisect_left(self._taken, final * per_sample, key=lambda taken: taken.step)
        taken, self._taken = self._taken[:ready], self._taken[ready:]
        electric, inner = None, None
        if taken and taken[0].trace:
            rows = _Rows.of(taken, drive, self._h)
            electric = rows.means(self._told, final, per_sample)
            inner = rows.inside(self._watch.window, self._h, self._skipped / self._fs, drive) if self._watch.window else None
        parts |= {"electric": electric, "inner": inner}
        self._watch.receive(WatchedStretch(self._told - self._skipped, reference, by_position=self._by_position, **parts))
        self._told = final


def _alone(x: Array) -> Array:
    return x if x.ndim == 2 else x[:, 0]


@dataclass(frozen=True, eq=False)
class _Rows:
    """Steps of a drive as arrays: when they begin and how long they last, in physics steps, and what happens in them."""

    start: Array
    length: Array
    electric: Electric
    tau: Array
    trace: Trace

    @classmethod
    def of(cls, taken: Sequence[Step], drive: AbstractAmplifier, h: float) -> "_Rows":
        """Return the steps of a drive, unrolled: a trace, or a torque, that has several rows says what each step did."""
        steps = np.array([s.steps for s in taken])
        rows = np.array([max([len(x) for x in s.trace if x.ndim == 3], default=1) for s in taken])
        count = np.array([max(n, len(s.tau)) for n, s in zip(rows, taken, strict=True)])
        length = np.repeat(steps // count, count)
        within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
        start = np.repeat([s.step for s in taken], count) + within * length
        traces = tuple(_unrolled(x, rows) for x in zip(*(s.trace for s in taken), strict=True))
        whole = drive.electric(traces, (np.repeat(steps / rows, rows) * h)[:, None])
        again = np.repeat(count // rows, rows)  # a mean over several steps holds for each of them
        electric = Electric(*(np.repeat(x, again, axis=0) for x in whole))
        trace = tuple(np.repeat(x, again, axis=0) for x in traces)
        return cls(start, length.astype(np.float64), electric, _unrolled([s.tau for s in taken], count), trace)

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


def _unrolled(arrays: Sequence[Array], count: npt.NDArray[np.int64]) -> Array:
    """Return arrays of shape (steps or 1, nsim, joint) or (nsim, joint) of the first simulation as one, `count` rows each."""
    if arrays[0].ndim == 2:
        return np.repeat([x[0] for x in arrays], count, axis=0)
    rows, lengths = np.concatenate([x[:, 0] for x in arrays]), np.array([len(x) for x in arrays])
    return rows if (lengths == count).all() else np.repeat(rows, count, axis=0)
