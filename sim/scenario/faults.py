"""Faults of robots and logs, each by its name: what a log becomes of which the doctor names the cause."""

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated, Any, NamedTuple

import numpy as np
from pydantic import Field

from idbench.identify.data.motion_log import MotionLog
from idbench.identify.plugins import did_you_mean
from idbench.sim.errors import ScenarioError
from idbench.sim.robot.inverse_dynamics import coulomb_torque, inverse_dynamics
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.settings import NotNegative, Number, Positive, Whole, settings

HELD = 0.1  # Distance of a payload from the frame of the last link [m]
SHAKEN = 3.0  # Frequency at which a base moves [Hz]
SLOW = 0.2  # Velocity of the Stribeck effect over the joint's rms speed
PRESLIDING = 0.03  # Distance in which friction turns, over the standard deviation of the joint's positions
RANGES = {
    "saturation": (0.0, 1.0),
    "falling-constant": (0.0, 1.0),
    "rate": (-0.9, 9.0),
    "clock-drift": (-0.1, 0.1),
    "dropouts": (0.0, 1.0),
}
"""Sizes of some faults, between which they make sense."""

OF_PAIRS = frozenset({"coupled-rotor", "exchanged-torques", "exchanged-positions", "exchanged"})
"""Faults of a joint and the next."""

STEEP = 10.0  # Of teeth that change sides: over the standard deviation of what they carry


@settings
class Fault:
    """Something wrong with the robot or its log, as `idbench list` names it."""

    kind: str
    """What is wrong."""
    size: Number = 0.0
    """How large, in the unit of its kind."""
    joint: str = ""
    """Name of the joint; by default all of them, or the robot."""
    start: NotNegative = 0.0
    """From when on it is there [s]."""
    end: Positive | None = None
    """Until when [s]; by default to the end."""
    waves: Annotated[Whole, Field(ge=1)] = 12
    """Waves a turn, of ripples."""

    def __post_init__(self) -> None:
        if self.kind not in FAULTS:
            raise ScenarioError(f"kind = {self.kind!r} is unknown{did_you_mean(self.kind, FAULTS)}; known: {', '.join(FAULTS)}")
        flaw, low, high = FAULTS[self.kind], *RANGES.get(self.kind, (-np.inf, np.inf))
        if flaw.unit and not (self.size and low < self.size < high):
            between = f", between {low:g} and {high:g}" if self.kind in RANGES else ""
            raise ScenarioError(
                f"size = {self.size:g} [{flaw.unit}] of a fault {self.kind!r} must be a number other than 0{between}"
            )
        if self.end is not None and self.end <= self.start:
            raise ScenarioError(f"end = {self.end:g} s must be after start = {self.start:g} s")
        if self.kind == "rate" and (self.start or self.end):
            raise ScenarioError("start and end have no effect on a fault 'rate': the times of a log are one rate's")
        if self.kind in OF_PAIRS and not self.joint:
            raise ScenarioError(f"joint is missing: a fault {self.kind!r} is of a joint and the next")

    def times(self, severity: float) -> "Fault":
        """The same fault, so many times as large."""
        size = 1 - severity * (1 - self.size) if self.kind == "saturation" else severity * self.size
        return replace(self, size=size)


@dataclass(eq=False)
class _Record:
    """A log while faults are put into it, and the true motion; shape (time, joint) each."""

    robot: Robot
    fs: float
    q: Array
    tau: Array
    true: tuple[Array, Array, Array]
    rng: np.random.Generator

    @cached_property
    def t(self) -> Array:
        return np.arange(len(self.q)) / self.fs

    @cached_property
    def load(self) -> Array:
        return inverse_dynamics(_frictionless(self.robot), *self.true)

    @cached_property
    def friction(self) -> Array:
        return self.robot.model.dof_damping * self.true[1] + coulomb_torque(self.robot, self.true[1])

    def on(self, change: Callable[[Any], None]) -> Array:
        """What a change of the model's fields adds to the torques of links and rotors."""
        changed = _frictionless(self.robot)
        change(changed.model)
        return inverse_dynamics(changed, *self.true) - self.load


def _frictionless(robot: Robot) -> Robot:
    model = copy(robot.model)
    model.dof_damping[:] = 0.0
    model.dof_frictionloss[:] = 0.0
    return replace(robot, model=model)


class _Joint(NamedTuple):
    """A joint of a record, and the fault that is put into it; q and tau are parts of the record."""

    record: _Record
    j: int
    size: float
    waves: int
    t: Array
    q: Array
    tau: Array
    angle: Array
    qd: Array
    qdd: Array

    @property
    def load(self) -> Array:
        return self.record.load[:, self.j]

    @property
    def friction(self) -> Array:
        return self.record.friction[:, self.j]

    @property
    def wave(self) -> Array:
        return np.asarray(np.sin(self.waves * self.angle))


Apply = Callable[[_Joint], None]
"""Puts a fault into the log of a joint."""


class Flaw(NamedTuple):
    """A kind of fault, and what the doctor calls it."""

    what: str
    """What is wrong."""
    unit: str
    """Of its size; empty if it has none."""
    cause: tuple[str, str]
    """What the doctor calls it, and what it is a mistake of."""
    apply: Apply
    """Puts it into the log."""
    whole: bool = False
    """Whether it is the robot's, not a joint's."""


def _torque(f: Callable[[_Joint], Array | float]) -> Apply:
    """A torque more."""

    def apply(x: _Joint) -> None:
        x.tau[:] += f(x)

    return apply


def _torque_is(f: Callable[[_Joint], Array]) -> Apply:
    """Another torque."""

    def apply(x: _Joint) -> None:
        x.tau[:] = f(x)

    return apply


def _position_is(f: Callable[[_Joint], Array]) -> Apply:
    """Another position."""

    def apply(x: _Joint) -> None:
        x.q[:] = f(x)

    return apply


def _of_model(change: Callable[[_Joint, Any], None], time: Callable[[Array], Array] = np.ones_like) -> Apply:
    """What another model adds to the torques, times a function of time."""

    def apply(x: _Joint) -> None:
        x.record.tau += x.record.on(lambda model: change(x, model)) * time(x.t)[:, None]

    return apply


def _exchanged(*columns: str) -> Apply:
    """Columns exchanged with those of the next joint."""

    def apply(x: _Joint) -> None:
        pair = [x.j, (x.j + 1) % x.record.q.shape[1]]
        for name in columns:
            getattr(x.record, name)[:, pair] = getattr(x.record, name)[:, pair[::-1]]

    return apply


def _turned(x: _Joint) -> None:
    x.q[:], x.tau[:] = -x.q, -x.tau


def _largest(x: _Joint) -> float:
    return float(np.abs(x.tau).max())


def _faster(x: _Joint) -> None:
    x.record.fs /= 1 + x.size


def _drifting(x: _Joint) -> None:
    x.record.tau = np.array([np.interp(x.t * (1 - x.size), x.t, tau) for tau in x.record.tau.T]).T


def _coupled(x: _Joint) -> None:
    """The rotor of the next joint turns with this one, I (qdd_j + qdd_k) of both; it was one of the next alone."""
    k, qdd = (x.j + 1) % x.record.q.shape[1], x.record.true[2]
    x.tau[:] += x.size * (qdd[:, x.j] + qdd[:, k])
    x.record.tau[:, k] += x.size * qdd[:, x.j]


def _presliding(x: _Joint) -> Array:
    """Dahl's friction less Coulomb's: size (z - sign(qd)), dz/dq = (sign(qd) - z) / distance."""
    distance, z, found = PRESLIDING * np.std(x.angle) or 1.0, 0.0, np.zeros(len(x.angle))
    for k, step in enumerate(np.diff(x.angle, prepend=x.angle[0])):
        z = np.sign(step) + (z - np.sign(step)) * np.exp(-np.abs(step) / distance)
        found[k] = z
    return x.size * (found - np.sign(x.qd))


def _dropped(x: _Joint) -> None:
    """Samples that repeat the one before: a share `size` of all, six at a time."""
    r = x.record
    for k in r.rng.integers(0, len(r.t), max(1, round(x.size * len(r.t) / 6))):
        r.q[k + 1 : k + 7], r.tau[k + 1 : k + 7] = r.q[k], r.tau[k]


def _across(model: Any) -> Array:
    """An axis across gravity."""
    return np.asarray(np.linalg.svd(model.opt.gravity[None])[2][1])


def _tilted(x: _Joint, model: Any) -> None:
    g = np.array(model.opt.gravity)
    model.opt.gravity[:] = np.cos(x.size) * g + np.sin(x.size) * np.cross(_across(model), g)


def _shaken(x: _Joint, model: Any) -> None:
    g = np.array(model.opt.gravity)
    model.opt.gravity[:] += x.size * (np.cross(_across(model), g / np.linalg.norm(g)) if g.any() else _across(model))


def _weightless(x: _Joint, model: Any) -> None:
    del x
    model.opt.gravity[:] = 0.0


def _loaded(x: _Joint, model: Any) -> None:
    """A point mass at the last link, `HELD` from its frame; the inertia that it adds is taken as that of a sphere."""
    body, more = model.jnt_bodyid[-1], np.array([HELD, 0.0, 0.0])
    mass, place = float(model.body_mass[body]), np.array(model.body_ipos[body])
    model.body_ipos[body] = (mass * place + x.size * more) / (mass + x.size)
    model.body_mass[body] = mass + x.size
    model.body_inertia[body] += mass * x.size / (mass + x.size) * (more - place) @ (more - place)


def _longer(x: _Joint, model: Any) -> None:
    body = model.jnt_bodyid[x.j]
    way = np.array(model.body_pos[body])
    model.body_pos[body] = way + x.size * way / (float(np.linalg.norm(way)) or 1.0)


def _bent(x: _Joint, model: Any) -> None:
    axis = np.array(model.jnt_axis[x.j])
    across = np.cross(np.eye(3)[np.argmin(np.abs(axis))], axis)
    model.jnt_axis[x.j] = np.cos(x.size) * axis + np.sin(x.size) * across / np.linalg.norm(across)


FAULTS: Mapping[str, Flaw] = {
    "gain": Flaw("the torque is too large, by a share", "1", ("gain", "torque"), _torque(lambda x: x.size * x.tau)),
    "sign": Flaw("the torque has the other sign", "", ("sign", "torque"), _torque_is(lambda x: -x.tau)),
    "position-sign": Flaw("the position has the other sign", "", ("sign", "position"), _position_is(lambda x: -x.q)),
    "axis-sign": Flaw("the axis points the other way", "", ("sign", "joint"), _turned),
    "offset": Flaw("the torque has an offset", "N m", ("offset", "torque"), _torque(lambda x: x.size)),
    "drift": Flaw("the torque drifts", "N m/s", ("drift", "torque"), _torque(lambda x: x.size * x.t)),
    "saturation": Flaw(
        "torques end at a share of the largest", "1", ("saturation", "torque"),
        _torque_is(lambda x: np.clip(x.tau, -x.size * _largest(x), x.size * _largest(x))),
    ),
    "falling-constant": Flaw(
        "currents say more than the torque constant still gives, by a share at the largest", "1", ("saturation", "torque"),
        _torque_is(lambda x: x.tau / (1 - x.size * (x.tau / (_largest(x) or 1.0)) ** 2)),
    ),
    "dead-band": Flaw(
        "small torques are not logged", "N m", ("dead_band", "torque"), _torque(lambda x: -np.clip(x.tau, -x.size, x.size))
    ),
    "delay": Flaw(
        "the torque is logged late", "s", ("delay", "torque"),
        _torque_is(lambda x: np.interp(x.t - x.size, x.t, x.tau)),
    ),
    "position-delay": Flaw(
        "the position is logged late", "s", ("delay", "position"),
        _position_is(lambda x: np.interp(x.t - x.size, x.t, x.q)),
    ),
    "zero": Flaw("the zero of the position is off", "rad", ("zero", "position"), _position_is(lambda x: x.q + x.size)),
    "scale": Flaw("positions too large, by a share", "1", ("scale", "position"), _position_is(lambda x: x.q + x.size * x.q)),
    "eccentric": Flaw(
        "the encoder is eccentric", "rad", ("eccentric", "position"), _position_is(lambda x: x.q + x.size * np.sin(x.q))
    ),
    "degrees": Flaw("the position is in degrees", "", ("unit", "joint"), _position_is(lambda x: np.degrees(x.q))),
    "rotor": Flaw("a rotor more", "kg m^2", ("rotor", "drive"), _torque(lambda x: x.size * x.qdd)),
    "coupled-rotor": Flaw("the rotor of the next joint turns with this one", "kg m^2", ("coupled_rotor", "drive"), _coupled),
    "spring": Flaw("a spring", "N m/rad", ("spring", "drive"), _torque(lambda x: x.size * x.angle)),
    "load-friction": Flaw(
        "friction that grows with the load, by a share of it", "1", ("load", "friction"),
        _torque(lambda x: x.size * np.abs(x.load) * np.sign(x.qd)),
    ),
    "stribeck": Flaw(
        "more friction near rest", "N m", ("velocity", "friction"),
        _torque(lambda x: x.size * np.exp(-((x.qd / (SLOW * x.qd.std() or 1.0)) ** 2)) * np.sign(x.qd)),
    ),
    "asymmetry": Flaw(
        "friction that differs by direction", "N m s/rad", ("asymmetry", "friction"), _torque(lambda x: x.size * np.abs(x.qd))
    ),
    "warming": Flaw(
        "friction that falls to the end, by a share", "1", ("warming", "friction"),
        _torque(lambda x: -x.size * x.t / x.t[-1] * x.friction),
    ),
    "hysteresis": Flaw("friction turns over a distance (Dahl)", "N m", ("hysteresis", "friction"), _torque(_presliding)),
    "cogging": Flaw("cogging of so many waves", "N m", ("cogging", "drive"), _torque(lambda x: x.size * x.wave)),
    "commutation": Flaw(
        "a ripple of the torque constant of so many waves, by a share", "1", ("commutation", "drive"),
        _torque(lambda x: x.size * x.wave * (x.load + x.friction)),
    ),
    "backlash": Flaw(
        "play, with the encoder at the motor", "rad", ("backlash", "drive"),
        _position_is(lambda x: x.q + x.size / 2 * np.tanh(STEEP * x.load / (x.load.std() or 1.0))),
    ),
    "elasticity": Flaw(
        "an elastic gear, with the encoder at the motor", "rad/(N m)", ("elasticity", "drive"),
        _position_is(lambda x: x.q + x.size * x.load),
    ),
    "push": Flaw("a push", "N m", ("collision", "torque"), _torque(lambda x: x.size)),
    "unlogged": Flaw(
        "noise in the place of the torque", "N m", ("missing_torque", "torque"),
        _torque_is(lambda x: x.size * x.record.rng.standard_normal(len(x.tau))),
    ),
    "exchanged-torques": Flaw("torque exchanged with that of the next joint", "", ("exchanged", "torque"), _exchanged("tau")),
    "exchanged-positions": Flaw("position exchanged with that of the next", "", ("exchanged", "position"), _exchanged("q")),
    "exchanged": Flaw("columns exchanged with those of the next joint", "", ("exchanged", "joint"), _exchanged("q", "tau")),
    "length": Flaw("the joint is farther from the one before", "m", ("length", "link"), _of_model(_longer)),
    "axis": Flaw("the axis is turned", "rad", ("axis", "link"), _of_model(_bent)),
    "payload": Flaw("a payload 0.1 m from the last link's frame", "kg", ("payload", "link"), _of_model(_loaded), whole=True),
    "tilt": Flaw("the base is tilted", "rad", ("gravity", "base"), _of_model(_tilted), whole=True),
    "compensated": Flaw("gravity is not in the torques", "", ("gravity", "base"), _of_model(_weightless), whole=True),
    "base-motion": Flaw(
        "the base moves at 3 Hz", "m/s^2", ("base_motion", "base"),
        _of_model(_shaken, lambda t: np.sin(2 * np.pi * SHAKEN * t)), whole=True,
    ),
    "rate": Flaw("the motion is faster than the times say, by a share", "1", ("rate", "clock"), _faster, whole=True),
    "clock-drift": Flaw(
        "clocks of positions and torques drift apart", "s/s", ("clock_drift", "clock"), _drifting, whole=True
    ),
    "dropouts": Flaw("samples that repeat the one before, a share", "1", ("dropouts", "log"), _dropped, whole=True),
}  # fmt: skip
"""Every fault that a scenario can inject."""


def require_joints(robot: Robot, faults: Sequence[Fault]) -> None:
    """Raise ScenarioError if a robot has no joint that a fault names, or a fault is of the whole robot."""
    for fault in faults:
        whole, joints = FAULTS[fault.kind].whole, robot.joints
        if fault.joint and (whole or fault.joint not in joints):
            known = "it is of the whole robot: leave joint out" if whole else f"joints are {', '.join(joints)}"
            raise ScenarioError(f"fault {fault.kind!r}: joint = {fault.joint!r}; {known}")
        if fault.kind in OF_PAIRS and fault.joint == joints[-1]:
            raise ScenarioError(f"fault {fault.kind!r}: there is no joint after {fault.joint!r}")


def with_faults(
    robot: Robot, log: MotionLog, true: tuple[Array, Array, Array], faults: Sequence[Fault], rng: np.random.Generator
) -> MotionLog:
    """The log of one run with faults in it, one after the other, each from its start to its end.

    Parameters
    ----------
    robot : Robot
        The true robot.
    log : MotionLog
        What it would log.
    true : tuple of Array, shape (time, joint)
        Its positions, velocities and accelerations at the instants of the log.
    faults : sequence of Fault
        What is wrong.
    rng : numpy.random.Generator
        Of what is random in them.
    """
    record = _Record(robot, log.fs, log.q.copy(), log.tau.copy(), true, rng)
    t, joints = record.t, robot.joints
    for fault in faults:
        kind = FAULTS[fault.kind]
        before = record.q.copy(), record.tau.copy()
        for j in (0,) if kind.whole else (joints.index(fault.joint),) if fault.joint else range(len(joints)):
            columns = (x[:, j] for x in (record.q, record.tau, *true))
            kind.apply(_Joint(record, j, fault.size, fault.waves, t, *columns))
        outside = (t < fault.start) | (t > (np.inf if fault.end is None else fault.end))
        record.q[outside], record.tau[outside] = before[0][outside], before[1][outside]
    return replace(log, fs=record.fs, q=record.q, tau=record.tau)
