"""What was logged of one servo: commands and positions."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.ndimage import median_filter

from idbench.identify.arrays import Array, frozen
from idbench.identify.data.jumps import encoder_steps
from idbench.identify.errors import LogError, SettingError
from idbench.identify.servo.law import Servo

PARTS = ("inertia", "sine", "cosine", "rest", "lightness", "shaking")  # Of a load


@dataclass(frozen=True, eq=False)
class JointLoad:
    """The torque that the links need of one joint, J qdd + sine sin(q) + cosine cos(q) + rest, q being the angle of the file.

    Exact for one joint. Of an arm, the other joints move as they were measured: J and the coefficients then vary over time, and
    `rest` has what their accelerations and velocities need.
    """

    inertia: Array
    """J [kg m^2], shape (time,) or ()."""
    sine: Array
    """Torque per sine of the joint's angle [N m], shape (time,) or ()."""
    cosine: Array
    """Torque per cosine of the joint's angle [N m], shape (time,) or ()."""
    rest: Array
    """Torque that does not depend on the angle [N m], shape (time,) or ()."""
    lightness: Array = field(default_factory=lambda: np.zeros(()))
    """Of a simulation (see `TimeSteps`): diagonal of the inverse mass matrix of all joints [1/(kg m^2)], shape (time,)."""
    shaking: Array = field(default_factory=lambda: np.zeros(()))
    """Of a simulation: acceleration by which its dry friction sees the damping of other joints [rad/s^2], shape (time,)."""
    t: Array | None = None
    """Times [s], on the clock of the log, shape (time,); None of a load that is constant."""

    def __post_init__(self) -> None:
        for name in PARTS:
            values = frozen(getattr(self, name))
            if values.ndim > 1 or not np.isfinite(values).all():
                raise SettingError(f"{name} of a load must be finite numbers, of the shape (time,) or one number")
            if values.ndim and (self.t is None or len(self.t) != len(values)):
                raise SettingError(f"{name} of a load varies: give its times")
            object.__setattr__(self, name, values)
        if (self.inertia < 0).any():
            raise SettingError(f"inertia = {self.inertia.min():g} kg m^2 of a load must not be negative")

    def over(self, t: Array) -> tuple[Array, ...]:
        """Its parts at some times [s], each of their shape."""
        return tuple(
            np.interp(t, self.t, x) if x.ndim and self.t is not None else np.broadcast_to(x, np.shape(t))
            for x in (getattr(self, name) for name in PARTS)
        )

    def torque(self, t: Array, q: Array) -> Array:
        """Torque that keeps the joint at q [rad] at times t [s] while the others move as measured [N m]."""
        _, sine, cosine, rest, *_ = self.over(t)
        return np.asarray(sine * np.sin(q) + cosine * np.cos(q) + rest)


MIN_SAMPLES = 20  # Samples that a run must have
SPIKE = 5.0  # Times the longest way of the joint in a sample: a position that is further from those about it was not read well
BESIDE = 5  # Samples whose median a position is compared with


def well_read(q: Array) -> npt.NDArray[np.bool_]:
    """True for positions of a joint [rad], shape (time,), that are no spikes."""
    typical = median_filter(q, BESIDE, mode="nearest")
    moves = np.abs(np.diff(q))
    longest = max(np.abs(np.diff(typical)).max(), moves[moves > 0].min(initial=np.inf) if moves.any() else 0.0)
    return np.asarray(np.abs(q - typical) <= SPIKE * longest)


def without_spikes(t: Array, q: Array) -> Array:
    """Positions of a joint [rad], shape (time,), spikes interpolated."""
    well = well_read(q)
    return np.interp(t, t[well], q[well])


@dataclass(frozen=True, eq=False)
class ServoRun:
    """Commands and positions of one joint, with their times as logged.

    Raises
    ------
    LogError
        If shapes differ, values are missing, time does not increase, or there are too few samples.
    """

    t: Array
    """Times [s], increasing; steps may differ, shape (time,)."""
    q: Array
    """Position that the servo reports [rad], shape (time,)."""
    command: Array
    """Commanded position from each sample on [rad], shape (time,)."""
    load: JointLoad
    """What the joint carries."""
    servo: Servo
    """What is known of the loop."""
    on: npt.NDArray[np.bool_] | None = None
    """Whether torque is enabled; by default always, shape (time,)."""
    voltage: Array | None = None
    """Supply [V], where it was logged, shape (time,)."""
    forward: Array | None = None
    """What is commanded beside the angle: duty, torque [N m] or current [A] from each sample on, shape (time,)."""
    range: tuple[float, float] = (-np.inf, np.inf)
    """Smallest and largest angle of the joint in its robot's file [rad]."""
    name: str = field(default="the log", kw_only=True)
    """What messages call the run."""

    def __post_init__(self) -> None:
        for name in ("t", "q", "command", "voltage", "forward"):
            if (values := getattr(self, name)) is not None:
                object.__setattr__(self, name, self._checked(name, frozen(values)))
        on = np.ones(len(self.t), dtype=bool) if self.on is None else np.array(self.on, dtype=bool)
        if on.shape != self.t.shape:
            raise LogError(f"{self.name}: torque on has shape {on.shape}, t {self.t.shape}")
        object.__setattr__(self, "on", on)
        if len(self.t) < MIN_SAMPLES:
            raise LogError(f"{self.name} has {len(self.t)} samples; at least {MIN_SAMPLES} are needed")
        if (np.diff(self.t) <= 0).any():
            k = int(np.argmax(np.diff(self.t) <= 0))
            raise LogError(f"{self.name}: time does not increase after t = {self.t[k]:.6g} s; remove repeated rows")

    def _checked(self, name: str, values: Array) -> Array:
        if values.ndim != 1 or np.shape(values) != np.shape(self.t):
            raise LogError(f"{self.name}: {name} has shape {values.shape}, t {np.shape(self.t)}: one value per sample")
        if not np.isfinite(values).all():
            k = int(np.argmax(~np.isfinite(values)))
            raise LogError(f"{self.name}: {name} is {values[k]} at sample {k}; remove or repair such samples first")
        return values

    @property
    def enabled(self) -> npt.NDArray[np.bool_]:
        """Whether torque is enabled, shape (time,)."""
        assert self.on is not None
        return self.on

    @property
    def T(self) -> float:
        """Typical time between samples [s]."""
        return float(np.median(np.diff(self.t)))

    @cached_property
    def step(self) -> float:
        """Step of the logged positions [rad]: that of the firmware's encoder, or as they show it; 0: they are not rounded."""
        return self.servo.count or float(np.nan_to_num(encoder_steps(self.q[:, None])[0]))

    @cached_property
    def still(self) -> float:
        """Angle up to which a joint is at rest [rad]: a count of its encoder, or a share of its motion where it has none."""
        return self.step or STILL * float(np.ptp(self.clean))

    @cached_property
    def read_well(self) -> npt.NDArray[np.bool_]:
        """Whether each position can be one, shape (time,): spikes of the bus come back at once, joints do not."""
        return well_read(self.q)

    @property
    def offsets(self) -> tuple[float, float]:
        """Smallest and largest offset with which all angles of the file are within the range of the joint [rad]."""
        low, high = self.range[0] - float(self.clean.min()), self.range[1] - float(self.clean.max())
        return (low, high) if low < high else (-np.inf, np.inf)  # a joint beyond its range: the range is not to be believed

    @cached_property
    def clean(self) -> Array:
        """Positions without spikes, which are interpolated [rad], shape (time,)."""
        return without_spikes(self.t, self.q)


REST = 0.1  # How long joint and command have stood still where a run is cut [s], beside the delay of the command

AFTER = 0.05
"""How long they go on to do so [s]: a piece that begins with a motion needs its speed, and the instant when it began."""

SHORTEST = 0.8  # Least length of a piece [s]

STILL = 1e-3
"""Share of the range of a motion that stands for a count where positions are not rounded: 1000 in a range, as of 10 bits."""

MOVES = 4  # Counts by which a joint moves in a piece that says anything


def pieces(run: ServoRun, delay: float) -> list[ServoRun]:
    """A run in pieces that begin at rest, the target of the firmware where the command, late by `delay` [s] at most, is."""
    rest, step = REST + delay, run.still
    t, first = run.t, np.searchsorted(run.t, run.t - rest)
    last = np.searchsorted(run.t, run.t + AFTER, side="right")
    still = np.array([_rests(run, slice(i, k), step) for i, k in zip(first, last, strict=True)])
    still &= (t >= t[0] + rest) & (t <= t[-1] - AFTER)
    rests = np.flatnonzero(still)
    first_rest = int(rests[0]) if len(rests) else 0
    cuts = [first_rest if _may_begin(run, first_rest, step) else 0]
    for k in rests:
        if t[k] - t[cuts[-1]] >= SHORTEST and k - cuts[-1] >= MIN_SAMPLES:
            cuts.append(int(k))
    if len(cuts) > 1 and (t[-1] - t[cuts[-1]] < SHORTEST or len(t) - cuts[-1] < MIN_SAMPLES):
        cuts.pop()
    parts = [part_of(run, slice(a, b)) for a, b in zip(cuts, [*cuts[1:], len(t)], strict=True)]
    moving = [part for part in parts if np.ptp(part.clean) > MOVES * step]
    return moving or parts[:1]


def _may_begin(run: ServoRun, k: int, step: float) -> bool:
    """True if the initial transient before sample k may be dropped: it is short, and other motion follows."""
    t = run.t
    long = len(t) - k >= MIN_SAMPLES and t[-1] - t[k] >= SHORTEST
    return bool(t[k] - t[0] < SHORTEST and long and run.enabled[:k].all() and np.ptp(run.clean[k:]) > MOVES * step)


def _rests(run: ServoRun, some: slice, step: float) -> bool:
    on = run.enabled[some]
    steady = np.ptp(run.command[some]) == 0 and on.all() == on.any()
    return bool(steady and np.ptp(run.clean[some]) <= 1.5 * step)


def part_of(run: ServoRun, some: slice | npt.NDArray[np.intp], **others: Array) -> ServoRun:
    """Some samples of a run, with other values of some of its signals."""
    names = ("t", "q", "command", "on", "voltage", "forward")
    return replace(run, **{name: x[some] for name in names if (x := getattr(run, name)) is not None} | others)
