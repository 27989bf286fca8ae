"""A fitted robot along the motion of a log, and what changes of it make of the torque."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy

from idbench.identify.arrays import TINY, Array
from idbench.identify.basis.basis import Basis
from idbench.identify.basis.block import RIGID
from idbench.identify.basis.friction.laws import Cogging
from idbench.identify.basis.newton_euler import torques
from idbench.identify.basis.of_joints import OfJoints
from idbench.identify.basis.tree_links import TreeLinks
from idbench.identify.data.kinematics import KinematicTree
from idbench.identify.signals.signals import State

SETTLING = 0.2  # Time over which loads are averaged that teeth of gears carry [s]: a period of the usual band
SMALL = 1e-4  # Step of differences [rad, m, 1], small beside what robots move, large beside rounding


@dataclass(frozen=True, eq=False)
class FittedMotion:
    """A fitted robot along the motion of a log, at some instants of it."""

    basis: Basis
    """The robot."""
    X: Array
    """Its parameters, shape (p,)."""
    state: State
    """Its motion, shape (joint, time)."""
    t: Array
    """Instants [s], shape (time,)."""
    poses: bool = False
    """Whether they are poses at rest."""

    @property
    def n(self) -> int:
        """Number of joints."""
        return self.basis.n

    @cached_property
    def torque(self) -> Array:
        """The predicted torque, shape (joint, time)."""
        return self._of(self.basis, self.X, self.state)

    @cached_property
    def rigid(self) -> tuple[Basis, Array]:
        """Links, and rotors, alone."""
        basis = self.basis.only(RIGID)
        return basis, self.X[[self.basis.places[p] for p in basis.parameters]]

    @cached_property
    def load(self) -> Array:
        """Torque of links and rotors, shape (joint, time)."""
        return self._of(*self.rigid, self.state)

    @cached_property
    def carried(self) -> Array:
        """What the teeth of gears carry, y = b * (b * load), b a box of `SETTLING`, shape (joint, time).

        Without what steps of a position make of accelerations; measured torques have the noise that they would explain.
        """
        width = max(1, round(SETTLING * (len(self.t) - 1) / max(float(np.ptp(self.t)), TINY)))
        once = scipy.ndimage.uniform_filter1d(self.load, width, axis=-1, mode="nearest")
        return np.asarray(scipy.ndimage.uniform_filter1d(once, width, axis=-1, mode="nearest"))

    @cached_property
    def rates(self) -> tuple[Array, Array]:
        """First and second time derivative of the load, shape (joint, time)."""
        first = self.rate(self.load)
        return first, self.rate(first)

    def rate(self, x: Array) -> Array:
        """Return the time derivative of a signal, shape (..., time); 0 of poses at rest."""
        return np.zeros_like(x) if self.poses else np.asarray(np.gradient(x, self.t, axis=-1))

    def moved(self, j: int, x: Array, xd: Array, xdd: Array) -> Array:
        """Return the derivative of the torque by a motion of joint j, x with its derivatives, shape (joint, time)."""
        return np.asarray(sum(slopes[j] * change for slopes, change in zip(self._slopes, (x, xd, xdd), strict=True)))

    @cached_property
    def _slopes(self) -> Array:
        """Derivatives of the load by position, velocity and acceleration of each joint, shape (3, joint moved, joint, time)."""
        motion = np.stack([self.state.q, self.state.qd, self.state.qdd])
        steps = np.eye(3 * self.n).reshape(3, self.n, 3, self.n, 1) * SMALL
        every = np.moveaxis(motion + steps, (0, 1), (2, 3))  # all at once, one after the other in time
        q, qd, qdd = every.reshape(3, self.n, -1)
        load = self._of(*self.rigid, _state(q, qd, qdd)).reshape(self.n, 3, self.n, -1)
        return np.moveaxis((load - self.load[:, None, None]) / SMALL, 0, 2)

    def faster(self) -> Array:
        """Return the derivative of the torque by the rate of the clock: qd (1 + h), qdd (1 + 2 h)."""
        q, qd, qdd, h = self.state.q, self.state.qd * (1 + SMALL), self.state.qdd, SMALL
        of_rigid = (self._of(*self.rigid, _state(q, qd, qdd * (1 + 2 * h))) - self.load) / h
        ahead = _state(q, qd, qdd)
        rest = self._of(self.basis, self.X, ahead) - self._of(*self.rigid, ahead)  # friction, and what else is no rigid torque
        return np.asarray(of_rigid + (rest - (self.torque - self.load)) / h)

    def on(self, changed: Callable[[KinematicTree], KinematicTree]) -> Array | None:
        """Derivative of the torque by a change of the robot's tree, by a step of `SMALL`; None if it has no tree."""
        if self.tree is None:
            return None
        basis, X = self.rigid
        return np.asarray((self._of(on_tree(basis, changed(self.tree)), X, self.state) - self.load) / SMALL)

    @property
    def reach(self) -> float:
        """The largest distance from joint to joint [m]; 0 if it has no tree."""
        return max((float(np.linalg.norm(joint.position)) for joint in self.tree.joints[1:]), default=0.0) if self.tree else 0.0

    @cached_property
    def tree(self) -> KinematicTree | None:
        """Of the links, if they are those of a tree."""
        return tree_of(self.basis)

    def _of(self, basis: Basis, X: Array, state: State) -> Array:
        """Return the torque of a state, of which the motion may be a part that is repeated."""
        times = state.q.shape[-1] // len(self.t)
        conditions = {name: np.tile(x, times) for name, x in self.state.conditions.items()}
        return torques(basis, replace(state, conditions=conditions), X)


def tree_of(basis: Basis) -> KinematicTree | None:
    """Return the tree of a robot's links; None if they are no tree's."""
    return next((block.tree for block in basis.blocks if isinstance(block, TreeLinks)), None)


def on_tree(basis: Basis, tree: KinematicTree) -> Basis:
    """Return a basis whose links are those of another tree."""
    blocks = tuple(replace(block, tree=tree) if isinstance(block, TreeLinks) else block for block in basis.blocks)
    return replace(basis, blocks=blocks)


def with_first_link_moments(basis: Basis) -> Basis:
    """Return a basis with what gravity across the axis of the first joint makes of its link: its own first moments."""
    there = {(p.kind, p.joint) for p in basis.parameters}
    one_wave = OfJoints(Cogging(1.0), (0,))
    if ("first moment", 0) in there or set(one_wave.parameters(basis.n)) & set(basis.parameters):
        return basis
    return basis + one_wave


def _state(q: Array, qd: Array, qdd: Array) -> State:
    return State(q, qd, lambda _: qdd)
