"""How the links of a tree move, each in its own frame."""

from collections.abc import Iterator
from functools import cached_property
from typing import NamedTuple, TypeAlias
from weakref import proxy

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.data.kinematics import GROUND, Joint, KinematicTree
from idbench.identify.signals.signals import State

Term: TypeAlias = Array | float
"""A signal (..., time), or what it is at all times."""


class Vector(NamedTuple):
    """Three components."""

    x: Term
    y: Term
    z: Term


Matrix: TypeAlias = tuple[Vector, Vector, Vector]
"""Three rows."""

ZERO = Vector(0.0, 0.0, 0.0)  # of a twist that has no such part


def is_zero(a: Term) -> bool:
    """True if a term is zero at all times."""
    return isinstance(a, float) and a == 0.0


def times(a: Term, b: Term) -> Term:
    """Return a b."""
    if isinstance(b, float):
        a, b = b, a
    if isinstance(a, float):
        if a == 0.0:
            return 0.0
        if a == 1.0:
            return b
        if a == -1.0:
            return -b
    return a * b


def plus(*terms: Term) -> Term:
    """Return the sum."""
    total: Term = 0.0
    for term in terms:
        if not is_zero(term):
            total = term if is_zero(total) else total + term
    return total


def minus(a: Term, b: Term) -> Term:
    """Return a - b."""
    if is_zero(b):
        return a
    return -b if is_zero(a) else a - b


def add(*vectors: Vector) -> Vector:
    """Return the sum of vectors."""
    return Vector(*(plus(*components) for components in zip(*vectors, strict=True)))


def scaled(a: Term, v: Vector) -> Vector:
    """Return a v."""
    return Vector(times(a, v.x), times(a, v.y), times(a, v.z))


def dot(a: Vector, b: Vector) -> Term:
    """Return a' b."""
    return plus(times(a.x, b.x), times(a.y, b.y), times(a.z, b.z))


def cross(a: Vector, b: Vector) -> Vector:
    """Return a x b."""
    return Vector(
        minus(times(a.y, b.z), times(a.z, b.y)),
        minus(times(a.z, b.x), times(a.x, b.z)),
        minus(times(a.x, b.y), times(a.y, b.x)),
    )


def apply(M: Matrix, v: Vector) -> Vector:
    """Return M v."""
    return Vector(*(dot(row, v) for row in M))


def vector(values: Array) -> Vector:
    """Return a vector of constants."""
    return Vector(*(float(value) for value in values))


def matrix(values: Array) -> Matrix:
    """Return a matrix of constants."""
    x, y, z = (vector(row) for row in values)
    return x, y, z


class Twist(NamedTuple):
    """A velocity of a rigid body, or the derivative of one, at the origin of a frame."""

    v: Vector
    """Of the origin [m/s]."""
    w: Vector
    """Angular [rad/s]."""


STILL = Twist(ZERO, ZERO)


def bracket(a: Twist, b: Twist) -> Twist:
    """Return [a, b] = (w_a x v_b + v_a x w_b, w_a x w_b)."""
    return Twist(add(cross(a.w, b.v), cross(a.v, b.w)), cross(a.w, b.w))


class Placement:
    """Where the frame of a link stands in that of its parent, its joint at q [rad or m], shape (..., time)."""

    def __init__(self, joint: Joint, q: Term) -> None:
        along = np.outer(joint.axis, joint.axis)
        self._axis = vector(joint.axis)
        self._along = matrix(along)
        self._across = matrix(np.eye(3) - along)
        self._rotation = matrix(joint.rotation)
        self._back = matrix(joint.rotation.T)
        self._hinge = joint.kind == "hinge"
        position = vector(joint.position)
        anchor = vector(joint.anchor)
        moved = q if joint.zero == 0 else q - joint.zero
        if self._hinge:
            self._cos, self._sin = np.cos(moved), np.sin(moved)
            turned = add(anchor, scaled(-1.0, self._turned(anchor, 1.0)))
            self.S = Twist(cross(anchor, self._axis), self._axis)
        else:
            turned = scaled(moved, self._axis)
            self.S = Twist(self._axis, ZERO)
        self.position = add(position, apply(self._rotation, turned))

    def _turned(self, x: Vector, sign: float) -> Vector:
        """Return x turned about the axis, or back (Rodrigues): what is along the axis stays."""
        across = apply(self._across, x)
        return add(apply(self._along, x), scaled(self._cos, across), scaled(sign * self._sin, cross(self._axis, x)))

    def inward(self, x: Vector) -> Vector:
        """Return in the frame of the link what `x` is in that of the parent."""
        y = apply(self._back, x)
        return self._turned(y, -1.0) if self._hinge else y

    def outward(self, x: Vector) -> Vector:
        """Return in the frame of the parent what `x` is in that of the link."""
        return apply(self._rotation, self._turned(x, 1.0) if self._hinge else x)

    def carry(self, twist: Twist) -> Twist:
        """Return a twist of the parent as one of the link."""
        return Twist(self.inward(add(twist.v, cross(twist.w, self.position))), self.inward(twist.w))


class Twists:
    """Velocities, accelerations and unit motions of every link."""

    def __init__(self, tree: KinematicTree, state: State) -> None:
        self._tree, self._state = tree, proxy(state)  # the state keeps its twists: a circle would outlive long logs' pieces
        self.placements = [Placement(joint, state.q[..., j, :]) for j, joint in enumerate(tree.joints)]

    def _links(self) -> Iterator[tuple[int, int, Placement]]:
        """Yield the number of each link, that of its parent, and its placement."""
        for j, (joint, placement) in enumerate(zip(self._tree.joints, self.placements, strict=True)):
            yield j, joint.parent, placement

    @cached_property
    def velocity(self) -> list[Twist]:
        """V_j = X_j V_parent + S_j qd_j."""
        found: list[Twist] = []
        for j, parent, at in self._links():
            qd = self._state.qd[..., j, :]
            carried = at.carry(found[parent]) if parent != GROUND else STILL
            found.append(Twist(add(carried.v, scaled(qd, at.S.v)), add(carried.w, scaled(qd, at.S.w))))
        return found

    @cached_property
    def acceleration(self) -> list[Twist]:
        """dV_j/dt = X_j dV_parent/dt + S_j qdd_j + [V_j, S_j] qd_j."""
        found: list[Twist] = []
        for j, parent, at in self._links():
            qd, qdd = self._state.qd[..., j, :], self._state.qdd[..., j, :]
            carried = at.carry(found[parent]) if parent != GROUND else STILL
            turning = bracket(self.velocity[j], at.S)
            v = add(carried.v, scaled(qdd, at.S.v), scaled(qd, turning.v))
            found.append(Twist(v, add(carried.w, scaled(qdd, at.S.w), scaled(qd, turning.w))))
        return found

    @cached_property
    def up(self) -> list[Vector]:
        """Minus gravity, in the frame of every link [m/s^2]."""
        ground, found = vector(-self._tree.gravity), list[Vector]()
        for _, parent, at in self._links():
            found.append(at.inward(found[parent] if parent != GROUND else ground))
        return found

    @cached_property
    def height(self) -> list[Term]:
        """Potential of a unit mass at the origin of every link [m^2/s^2]."""
        ground, found = vector(-self._tree.gravity), list[Term]()
        for _, parent, at in self._links():
            before = (found[parent], self.up[parent]) if parent != GROUND else (0.0, ground)
            found.append(plus(before[0], dot(before[1], at.position)))
        return found

    @cached_property
    def unit(self) -> list[dict[int, Twist]]:
        """S_i in the frame of every link that joint i moves: dV_j / dqd_i."""
        return self._carried([at.S for at in self.placements])

    @cached_property
    def slope(self) -> list[dict[int, Twist]]:
        """dV_j / dq_i = [V_i, S_i], in the frame of every link that joint i moves."""
        return self._carried([bracket(V, at.S) for V, at in zip(self.velocity, self.placements, strict=True)])

    def _carried(self, own: list[Twist]) -> list[dict[int, Twist]]:
        found: list[dict[int, Twist]] = []
        for j, parent, at in self._links():
            carried = {i: at.carry(twist) for i, twist in found[parent].items()} if parent != GROUND else {}
            found.append({**carried, j: own[j]})
        return found
