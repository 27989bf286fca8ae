"""How the links of a tree move, each in its own frame."""

from collections.abc import Iterator
from functools import cached_property
from typing import NamedTuple
from weakref import proxy

import numpy as np

from idbench.identify.basis.terms import (
    ZERO,
    Term,
    Vector,
    add,
    apply,
    cross,
    dot,
    matrix,
    plus,
    scaled,
    transposed,
    vector,
)
from idbench.identify.data.kinematics import GROUND, Joint, KinematicTree
from idbench.identify.signals.state import State


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
    """Where the frame of a link stands in that of its parent, at all times.

    Parameters
    ----------
    joint : Joint
        That moves it.
    q : Array, shape (..., time)
        Its position [rad or m].
    """

    def __init__(self, joint: Joint, q: Term) -> None:
        along = np.outer(joint.axis, joint.axis)
        self._axis, self._along, self._across = vector(joint.axis), matrix(along), matrix(np.eye(3) - along)
        self._rotation = matrix(joint.rotation)
        self._back = transposed(self._rotation)
        self._hinge, position, anchor = joint.kind == "hinge", vector(joint.position), vector(joint.anchor)
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

    def carry(self, twist: Twist) -> Twist:
        """Return a twist of the parent as one of the link."""
        return Twist(self.inward(add(twist.v, cross(twist.w, self.position))), self.inward(twist.w))


class Twists:
    """Velocities, accelerations and unit motions of every link.

    Parameters
    ----------
    tree : KinematicTree
        The robot.
    state : State
        Its motion.
    """

    def __init__(self, tree: KinematicTree, state: State) -> None:
        self._tree, self._state = tree, proxy(state)  # the state keeps its twists: a circle would outlive long logs' pieces
        self._placements = [Placement(joint, state.q[..., j, :]) for j, joint in enumerate(tree.joints)]

    def _links(self) -> Iterator[tuple[int, int, Placement]]:
        """Yield the number of each link, that of its parent, and its placement."""
        for j, (joint, placement) in enumerate(zip(self._tree.joints, self._placements, strict=True)):
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
            found.append(
                Twist(
                    add(carried.v, scaled(qdd, at.S.v), scaled(qd, turning.v)),
                    add(carried.w, scaled(qdd, at.S.w), scaled(qd, turning.w)),
                )
            )
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
        return self._carried([at.S for at in self._placements])

    @cached_property
    def slope(self) -> list[dict[int, Twist]]:
        """dV_j / dq_i = [V_i, S_i], in the frame of every link that joint i moves."""
        return self._carried([bracket(V, at.S) for V, at in zip(self.velocity, self._placements, strict=True)])

    def _carried(self, own: list[Twist]) -> list[dict[int, Twist]]:
        found: list[dict[int, Twist]] = []
        for j, parent, at in self._links():
            carried = {i: at.carry(twist) for i, twist in found[parent].items()} if parent != GROUND else {}
            found.append({**carried, j: own[j]})
        return found
