"""Mistakes that people make with robots and logs: for each, the torque that a small one leaves unexplained.

A column is the derivative of logged - predicted torque by the size of a mistake, at a fit. What a mistake of several shapes may
leave, such as friction that curves, has a line for each.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import NamedTuple, TypeAlias

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.basis.block import Parameter
from idbench.identify.basis.tree_links import KINDS, TreeLinks
from idbench.identify.data.kinematics import KinematicTree
from idbench.identify.judge.fitted_motion import SMALL, FittedMotion

CREEP = (0.1, 0.3)
"""Velocities over a joint's rms speed above which friction near rest fades."""

PRESLIDING = (0.01, 0.03, 0.1)
"""Distances over the rms of a joint's positions in which friction turns."""

TURNS = tuple(range(2, 13))
"""Waves of a torque ripple a turn: of harmonic drives and motors with few poles, as far as rows of 5 Hz show them."""

Rows: TypeAlias = Mapping[int, Array]
"""Torques by the joint, shape (time,); none of the others."""


class Mistake(NamedTuple):
    """A mistake, and what it leaves unexplained."""

    cause: str
    """What is wrong, in a word."""
    columns: "Columns"
    """Of a joint, or of the robot: a column, or several that belong together."""
    unit: str = "1"
    """Of its size."""
    of: str = "torque"
    """What it is a mistake of: torque, position, friction, drive, base, link or clock."""
    setting: float = 0.0
    """Of cogging: waves a turn; of a length: along which axis."""
    most: float = np.inf
    """Size above which it is not small, and its column says nothing of it."""
    left: float = 1e-4
    """Share of its column's squares that parameters must leave for it to be distinct from them: less is noise of the positions,
    from which no column is free that is not made of those of the parameters."""
    positive: bool = False
    """Whether nothing makes a size below zero, which then is noise of the positions: compliance, play, an inertia, a load."""


Columns: TypeAlias = Callable[[FittedMotion, int], Rows | tuple[Rows, ...]]
Signal: TypeAlias = Callable[[FittedMotion, int], Array]


def _own(f: Signal) -> Columns:
    """Return columns that stand in the row of the joint alone."""

    def columns(m: FittedMotion, j: int) -> Rows:
        return {j: f(m, j)}

    return columns


def _all(x: Array | None) -> Rows:
    return {} if x is None else dict(enumerate(x))


def _zero(m: FittedMotion, j: int) -> Rows:
    one, none = np.ones_like(m.t), np.zeros_like(m.t)
    return _all(-m.moved(j, one, none, none))


def _scale(m: FittedMotion, j: int) -> Rows:
    state = m.state
    return _all(-m.moved(j, state.q[j], state.qd[j], state.qdd[j]))


def _late_position(m: FittedMotion, j: int) -> Rows:
    qd, qdd = m.state.qd[j], m.state.qdd[j]
    return _all(m.moved(j, qd, qdd, np.gradient(qdd, m.t)))


def _eccentric(m: FittedMotion, j: int) -> tuple[Rows, ...]:
    q, qd, qdd = (x[j] for x in (m.state.q, m.state.qd, m.state.qdd))
    sin, cos = np.sin(q), np.cos(q)
    return (
        _all(-m.moved(j, sin, cos * qd, cos * qdd - sin * qd**2)),
        _all(-m.moved(j, cos, -sin * qd, -sin * qdd - cos * qd**2)),
    )


def _backlash(m: FittedMotion, j: int) -> Rows:
    side, none = np.sign(m.load[j]), np.zeros_like(m.t)
    return _all(-m.moved(j, side, none, none))


def _elasticity(m: FittedMotion, j: int) -> Rows:
    first, second = m.rates
    return _all(-m.moved(j, m.load[j], first[j], second[j]))


def _cogging(waves: int) -> Columns:
    return lambda m, j: ({j: np.sin(waves * m.state.q[j])}, {j: np.cos(waves * m.state.q[j])})


def _presliding(m: FittedMotion, j: int, share: float) -> Array:
    """Return what friction lacks while it turns: z - sign(qd), dz/d|q| = (sign(qd) - z) / distance (Dahl)."""
    q, side = m.state.q[j], np.sign(m.state.qd[j])
    way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(q)))]) / max(share * float(np.std(q)), 1e-12)
    turns = np.flatnonzero(np.diff(side)) + 1
    z, lack = 0.0, np.zeros_like(q)
    for begin, end in zip([0, *turns], [*turns, len(q)], strict=True):
        gone = np.exp(-(way[begin:end] - way[begin]))
        lack[begin:end] = (z - side[begin]) * gone
        z = side[begin] + lack[end - 1]
    return lack


def _turning(share: float) -> Signal:
    return lambda m, j: _presliding(m, j, share)


def _coupled(m: FittedMotion, j: int) -> Rows:
    """Return what a rotor of joint j + 1 that is turned by joint j, too, makes of both."""
    return {j: m.state.qdd[j + 1], j + 1: m.state.qdd[j]} if j + 1 < m.n else {}


def _tilt(m: FittedMotion, j: int) -> tuple[Rows, ...]:
    del j
    if m.tree is None or not np.any(m.tree.gravity):
        return ()
    g = m.tree.gravity
    axes = np.linalg.svd(g[None])[2][1:]  # across gravity
    turned = (_all(m.on(partial(replace, gravity=g + SMALL * np.cross(a, g)))) for a in axes)
    # An axis that was along gravity now carries first moments that were no parameters.
    q = m.state.q[0]
    return (*turned, {0: np.sin(q)}, {0: np.cos(q)})


def _length(axis: int) -> Columns:
    def column(m: FittedMotion, j: int) -> Rows:
        def longer(tree: KinematicTree) -> KinematicTree:
            joint = tree.joints[j]
            moved = replace(joint, position=joint.position + SMALL * np.eye(3)[axis])
            return replace(tree, joints=(*tree.joints[:j], moved, *tree.joints[j + 1 :]))

        return _all(m.on(longer)) if j else {}

    return column


def _axis(m: FittedMotion, j: int) -> tuple[Rows, ...]:
    """Return what an axis has that is turned about two directions across it."""
    if m.tree is None or not j:  # the first is a tilt of the base
        return ()
    across = np.linalg.svd(m.tree.joints[j].axis[None])[2][1:]
    return tuple(_all(m.on(partial(_axis_turned, j=j, by=SMALL * a))) for a in across)


def _axis_turned(tree: KinematicTree, j: int, by: Array) -> KinematicTree:
    joint = tree.joints[j]
    moved = replace(joint, rotation=joint.rotation @ _rotation(by))
    return replace(tree, joints=(*tree.joints[:j], moved, *tree.joints[j + 1 :]))


def _rotation(v: Array) -> Array:
    """Return the rotation by a small vector (Rodrigues)."""
    angle = float(np.linalg.norm(v))
    K = np.cross(np.eye(3), v / angle)
    return np.asarray(np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K)


def _fading(share: float) -> Signal:
    """Return what friction has more near rest, up to a share of the joint's rms speed."""

    def signal(m: FittedMotion, j: int) -> Array:
        qd = m.state.qd[j]
        return np.asarray(np.sign(qd) * np.exp(-((qd / max(share * _rms(qd), 1e-12)) ** 2)))

    return signal


def _rms(x: Array) -> float:
    return max(float(np.sqrt(np.mean(x**2))), 1e-12)


def _friction(m: FittedMotion, j: int) -> float:
    """Return the rms of the fitted friction of a joint."""
    return _rms(m.torque[j] - m.load[j])


def _drag(m: FittedMotion, j: int) -> float:
    return _friction(m, j) / _rms(m.state.qd[j]) ** 2


def _alike(m: FittedMotion, j: int) -> float:
    del m, j
    return 1.0


def _every(f: Signal, scale: Callable[[FittedMotion, int], float] = _alike) -> Columns:
    """Return a column of all joints, whose drives are alike: each has its signal, times a scale of its own."""
    return lambda m, _: {j: scale(m, j) * f(m, j) for j in range(m.n)}


def _late(m: FittedMotion, j: int) -> Array:
    return -np.gradient(m.torque[j], m.t)


def _pushed(axis: int) -> Columns:
    """Return what an acceleration of the base along an axis makes of the torques."""

    def column(m: FittedMotion, j: int) -> Rows:
        del j
        return _all(m.on(lambda tree: replace(tree, gravity=tree.gravity - SMALL * np.eye(3)[axis])))

    return column


def _payload(m: FittedMotion, j: int) -> tuple[Rows, ...]:
    """Return what a mass, and its first moments, make of the torques at the last link."""
    del j
    if m.tree is None:
        return ()
    last = m.n - 1
    held = TreeLinks(m.tree, frozenset(Parameter(x, last, *KINDS[x]) for x in ("M", "MX", "MY", "MZ")))
    rows = dict[str, dict[int, Array]]()
    for (row, parameter), column in held.explicit(m.state).items():
        rows.setdefault(parameter.symbol, {})[row] = column
    return tuple(rows.values())


GAIN = Mistake("gain", _own(lambda m, j: m.torque[j]), most=1.0, left=1e-6)
"""Torques that are all too large."""

OF_JOINTS: tuple[Mistake, ...] = (
    GAIN,
    Mistake("offset", _own(lambda m, _: np.ones_like(m.t)), "N m"),
    Mistake("drift", _own(lambda m, _: m.t - m.t[0]), "N m/s"),
    Mistake("saturation", _own(lambda m, j: -(m.torque[j] ** 3)), "1/(N m)^2"),
    Mistake("dead_band", _own(lambda m, j: -np.sign(m.torque[j])), "N m"),
    Mistake("delay", _own(_late), "s"),
    Mistake("delay", _late_position, "s", "position"),
    Mistake("zero", _zero, "rad", "position", most=0.5),
    Mistake("scale", _scale, "1", "position", most=0.3),
    Mistake("eccentric", _eccentric, "rad", "position", most=0.5),
    Mistake("rotor", _own(lambda m, j: m.state.qdd[j]), "kg m^2", "drive", positive=True),
    Mistake("coupled_rotor", _coupled, "kg m^2", "drive"),
    Mistake("spring", _own(lambda m, j: m.state.q[j]), "N m/rad", "drive"),
    Mistake("load", _own(lambda m, j: np.abs(m.load[j]) * np.sign(m.state.qd[j])), "1", "friction", positive=True),
    *(Mistake("velocity", _own(_fading(share)), "N m", "friction") for share in CREEP),
    Mistake("velocity", _own(lambda m, j: m.state.qd[j] * np.abs(m.state.qd[j])), "N m s^2/rad^2", "friction"),
    Mistake("asymmetry", _own(lambda m, j: np.abs(m.state.qd[j])), "N m s/rad", "friction"),
    Mistake("warming", _own(lambda m, j: (m.t - m.t[0]) * m.state.qd[j]), "N m/rad", "friction"),
    Mistake("warming", _own(lambda m, j: (m.t - m.t[0]) * np.sign(m.state.qd[j])), "N m/s", "friction"),
    *(Mistake("hysteresis", _own(_turning(share)), "N m", "friction", positive=True) for share in PRESLIDING),
    *(Mistake("cogging", _cogging(k), "N m", "drive", k) for k in TURNS),
    Mistake("backlash", _backlash, "rad", "drive", positive=True),
    Mistake("elasticity", _elasticity, "rad/(N m)", "drive", positive=True),
    *(Mistake("length", _length(axis), "m", "link", axis) for axis in range(3)),
    Mistake("axis", _axis, "rad", "link", most=0.5),
)
"""Mistakes of a joint."""

OF_ROBOT: tuple[Mistake, ...] = (
    Mistake("tilt", _tilt, "rad", "base"),
    Mistake("delay", lambda m, _: _all(-np.gradient(m.torque, m.t, axis=-1)), "s"),
    Mistake("warming", lambda m, _: _all((m.t - m.t[0]) * (m.torque - m.load)), "1/s", "friction"),
    Mistake("load", _every(lambda m, j: np.abs(m.load[j]) * np.sign(m.state.qd[j])), "1", "friction", positive=True),
    *(Mistake("velocity", _every(_fading(share), _friction), "1", "friction") for share in CREEP),
    Mistake("velocity", _every(lambda m, j: m.state.qd[j] * np.abs(m.state.qd[j]), _drag), "1", "friction"),
    *(Mistake("hysteresis", _every(_turning(share), _friction), "1", "friction", positive=True) for share in PRESLIDING),
    Mistake("saturation", _every(lambda m, j: -(m.torque[j] ** 3), lambda m, j: 1 / _rms(m.torque[j]) ** 2), "1"),
    Mistake("rate", lambda m, _: _all(m.faster()), "1", "clock", most=0.3),
    Mistake("clock_drift", lambda m, _: _all(-(m.t - m.t[0]) * np.gradient(m.torque, m.t, axis=-1)), "s/s", "clock"),
)
"""Mistakes of the whole robot, or of all torques."""

FROM_AN_INSTANT: tuple[Mistake, ...] = (Mistake("payload", _payload, "kg", "link"),)
"""Mistakes that are looked for from each of some instants on; the zero of a joint, which is a slip then, is one, too."""

COLLISION = Mistake("collision", _own(lambda m, _: np.ones_like(m.t)), "N m")
"""A torque that acts for a moment, where residuals are largest."""

BASE: tuple[Mistake, ...] = tuple(Mistake("base_motion", _pushed(axis), "m/s^2", "base") for axis in range(3))
"""Motion of the base, at the frequencies that residuals have."""
