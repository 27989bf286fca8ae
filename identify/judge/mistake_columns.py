"""Columns of mistakes: the torque that a small one leaves unexplained, over its size."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import TypeAlias

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.basis.block import Parameter
from idbench.identify.basis.tree_links import KINDS, TreeLinks
from idbench.identify.data.kinematics import KinematicTree
from idbench.identify.judge.fitted_motion import SMALL, FittedMotion

CREEP = (0.1, 0.3)  # Velocities over a joint's rms speed above which friction near rest fades
PRESLIDING = (0.01, 0.03, 0.1)  # Distances over the rms of a joint's positions in which friction turns

PARTING = 0.1  # Torque over the rms of a joint's within which teeth of its gear change sides
LONG = 0.3  # Share of the largest distance between joints beyond which that of one is not a little off

Rows: TypeAlias = Mapping[int, Array]
"""Torques by the joint, shape (time,); none of the others."""

Columns: TypeAlias = Callable[[FittedMotion, int], Rows | tuple[Rows, ...]]
Signal: TypeAlias = Callable[[FittedMotion, int], Array]


def of_joint(f: Signal) -> Columns:
    """Return columns that stand in the row of the joint alone."""
    return lambda m, j: {j: f(m, j)}


def whole_rows(x: Array | None) -> Rows:
    """Return rows of all joints; none of nothing."""
    return {} if x is None else dict(enumerate(x))


def position_zero(m: FittedMotion, j: int) -> Rows:
    """Torque per zero offset of a position [N m/rad]."""
    one, none = np.ones_like(m.t), np.zeros_like(m.t)
    return whole_rows(-m.moved(j, one, none, none))


def position_scale(m: FittedMotion, j: int) -> Rows:
    """Torque per relative scale error of a position [N m]."""
    return whole_rows(-m.moved(j, m.state.q[j], m.state.qd[j], m.state.qdd[j]))


def late_position(m: FittedMotion, j: int) -> Rows:
    """Torque per delay of a position [N m/s]."""
    qd, qdd = m.state.qd[j], m.state.qdd[j]
    return whole_rows(m.moved(j, qd, qdd, m.rate(qdd)))


def eccentric(m: FittedMotion, j: int) -> tuple[Rows, ...]:
    """Torques of an eccentric encoder: position errors in sine and cosine of the position."""
    q, qd, qdd = (x[j] for x in (m.state.q, m.state.qd, m.state.qdd))
    sin, cos = np.sin(q), np.cos(q)
    return (
        whole_rows(-m.moved(j, sin, cos * qd, cos * qdd - sin * qd**2)),
        whole_rows(-m.moved(j, cos, -sin * qd, -sin * qdd - cos * qd**2)),
    )


def backlash(m: FittedMotion, j: int) -> Rows:
    """Torque per backlash, for an encoder at the motor [N m/rad]: teeth change sides with their load."""
    side = teeth(m, j)
    crossed = m.rate(side)
    return whole_rows(-m.moved(j, side, crossed, m.rate(crossed)))


def teeth(m: FittedMotion, j: int) -> Array:
    """Return on which side the teeth of a joint's gear are, from -1 to 1."""
    return np.asarray(np.tanh(m.carried[j] / (PARTING * rms(m.carried[j]))))


def elasticity(m: FittedMotion, j: int) -> Rows:
    """Torque per compliance of the gear, for an encoder at the motor."""
    first, second = m.rates
    return whole_rows(-m.moved(j, m.load[j], first[j], second[j]))


def ripple(m: FittedMotion, j: int) -> tuple[Rows, ...]:
    """Torques of a ripple of one wave a turn."""
    return {j: np.sin(m.state.q[j])}, {j: np.cos(m.state.q[j])}


def presliding(m: FittedMotion, j: int, share: float) -> Array:
    """Presliding deficit of Coulomb friction: z - sign(qd), dz/d|q| = (sign(qd) - z) / distance (Dahl)."""
    q, side = m.state.q[j], np.sign(m.state.qd[j])
    way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(q)))]) / max(share * float(np.std(q)), 1e-12)
    turns = np.flatnonzero(np.diff(side)) + 1
    z, lack = 0.0, np.zeros_like(q)
    for begin, end in zip([0, *turns], [*turns, len(q)], strict=True):
        gone = np.exp(-(way[begin:end] - way[begin]))
        lack[begin:end] = (z - side[begin]) * gone
        z = side[begin] + lack[end - 1]
    return lack


def turning(share: float) -> Signal:
    """Presliding deficit of friction over a share of the rms position."""
    return lambda m, j: presliding(m, j, share)


def coupled(m: FittedMotion, j: int) -> Rows:
    """Torques of the rotor of joint j + 1 that joint j turns, too."""
    return {j: m.state.qdd[j + 1], j + 1: m.state.qdd[j]} if j + 1 < m.n else {}


def tilt(m: FittedMotion, j: int) -> tuple[Rows, ...]:
    """Gravity torques per tilt about the two axes across gravity."""
    del j
    if m.tree is None or not np.any(m.tree.gravity):
        return ()
    g = m.tree.gravity
    axes = np.linalg.svd(g[None])[2][1:]  # across gravity
    turned = (whole_rows(m.on(partial(replace, gravity=g + SMALL * np.cross(a, g)))) for a in axes)
    # An axis that was along gravity now carries first moments that were no parameters.
    q = m.state.q[0]
    return (*turned, {0: np.sin(q)}, {0: np.cos(q)})


def link_length(m: FittedMotion, j: int, axis: int) -> Rows:
    """Return columns of an origin that is farther along an axis."""

    def longer(tree: KinematicTree) -> KinematicTree:
        moved = replace(tree.joints[j], position=tree.joints[j].position + SMALL * np.eye(3)[axis])
        return replace(tree, joints=(*tree.joints[:j], moved, *tree.joints[j + 1 :]))

    return whole_rows(m.on(longer)) if j else {}


def link_axis(m: FittedMotion, j: int) -> tuple[Rows, ...]:
    """Torques per misalignment of an axis about two directions across it."""
    if m.tree is None or not j:  # the first is a tilt of the base
        return ()
    across = np.linalg.svd(m.tree.joints[j].axis[None])[2][1:]
    return tuple(whole_rows(m.on(partial(axis_turned, j=j, by=SMALL * a))) for a in across)


def axis_turned(tree: KinematicTree, j: int, by: Array) -> KinematicTree:
    """Return a tree with an axis turned by a small vector."""
    joint = tree.joints[j]
    moved = replace(joint, rotation=joint.rotation @ rotation(by))
    return replace(tree, joints=(*tree.joints[:j], moved, *tree.joints[j + 1 :]))


def rotation(v: Array) -> Array:
    """Return the rotation by a vector (Rodrigues)."""
    angle = float(np.linalg.norm(v))
    K = np.cross(np.eye(3), v / (angle or 1.0))
    return np.asarray(np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K)


def fading(m: FittedMotion, j: int, share: float) -> Array:
    """Additional friction near rest, up to a share of the joint's rms speed."""
    qd = m.state.qd[j]
    return np.asarray(np.sign(qd) * np.exp(-((qd / max(share * rms(qd), 1e-12)) ** 2)))


def rms(x: Array) -> float:
    """Return the rms of a signal, above 0."""
    return max(float(np.sqrt(np.mean(x**2))), 1e-12)


def friction(m: FittedMotion, j: int) -> float:
    """Return the rms of the fitted friction of a joint."""
    return rms(m.torque[j] - m.load[j])


def drag(m: FittedMotion, j: int) -> float:
    """Return the friction of a joint over its squared speed."""
    return friction(m, j) / rms(m.state.qd[j]) ** 2


def of_every(f: Signal, scale: Callable[[FittedMotion, int], float] = lambda _, __: 1.0) -> Columns:
    """Return a column of all joints, whose drives are alike: each has its signal, times a scale of its own."""
    return lambda m, _: {j: scale(m, j) * f(m, j) for j in range(m.n)}


def asymmetric(m: FittedMotion, j: int) -> tuple[Rows, ...]:
    """Direction-dependent friction of all joints: |qd|, and a constant."""
    del j
    size = [friction(m, k) for k in range(m.n)]
    speed = [np.abs(qd) / rms(qd) for qd in m.state.qd]
    return {k: size[k] * speed[k] for k in range(m.n)}, {k: size[k] * np.ones_like(m.t) for k in range(m.n)}


def pushed(m: FittedMotion, j: int, axis: int) -> Rows:
    """Torques per acceleration of the base along an axis."""
    del j
    return whole_rows(m.on(lambda tree: replace(tree, gravity=tree.gravity - SMALL * np.eye(3)[axis])))


def payload(m: FittedMotion, j: int) -> tuple[Rows, ...]:
    """Torques per mass and first moments at the last link."""
    del j
    if m.tree is None:
        return ()
    last = m.n - 1
    held = TreeLinks(m.tree, frozenset(Parameter(x, last, *KINDS[x]) for x in ("M", "MX", "MY", "MZ")))
    rows = dict[str, dict[int, Array]]()
    for (row, parameter), column in held.explicit(m.state).items():
        rows.setdefault(parameter.symbol, {})[row] = column
    return tuple(rows.values())
