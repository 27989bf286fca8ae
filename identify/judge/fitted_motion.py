"""A fitted robot along the motion of a log, and what changes of it make of the torque."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import final

import numpy as np

from idbench.identify.arrays import Array, combined
from idbench.identify.basis.basis import Basis
from idbench.identify.basis.block import RIGID
from idbench.identify.basis.tree_links import TreeLinks
from idbench.identify.data.kinematics import KinematicTree
from idbench.identify.signals.signals import State

SMALL = 1e-4
"""Step of differences [rad, m, 1], small beside what robots move, large beside rounding."""


@final
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
    def rates(self) -> tuple[Array, Array]:
        """First and second time derivative of the load, shape (joint, time)."""
        first = np.gradient(self.load, self.t, axis=-1)
        return first, np.gradient(first, self.t, axis=-1)

    def moved(self, j: int, x: Array, xd: Array, xdd: Array) -> Array:
        """Return the derivative of the torque by a motion of joint j, x with its derivatives, shape (joint, time)."""
        size = SMALL / max(float(np.abs(x).max()), 1e-12)
        return np.asarray((self.at(j, size * x, size * xd, size * xdd) - self.load) / size)

    def at(self, j: int, x: Array, xd: Array, xdd: Array) -> Array:
        """Return the torque of links and rotors with joint j moved by x, with its derivatives, shape (joint, time)."""
        q, qd, qdd = (np.array(each) for each in (self.state.q, self.state.qd, self.state.qdd))
        for each, change in ((q, x), (qd, xd), (qdd, xdd)):
            each[j] += change
        return self._of(*self.rigid, _state(q, qd, qdd))

    def faster(self) -> Array:
        """Return the derivative of the torque by the rate of the clock: qd (1 + h), qdd (1 + 2 h)."""
        state, h = self.state, SMALL
        ahead = _state(state.q, state.qd * (1 + h), state.qdd * (1 + 2 * h))
        return np.asarray((self._of(*self.rigid, ahead) - self.load) / h) + self._friction_slope()

    def on(self, changed: Callable[[KinematicTree], KinematicTree]) -> Array | None:
        """Return what the torque of a robot whose tree is changed by `SMALL` has more, over that; None if it has no tree."""
        if self.tree is None:
            return None
        basis, X = self.rigid
        return np.asarray((self._of(on_tree(basis, changed(self.tree)), X, self.state) - self.load) / SMALL)

    @cached_property
    def tree(self) -> KinematicTree | None:
        """Of the links, if they are those of a tree."""
        return tree_of(self.basis)

    def _friction_slope(self) -> Array:
        """Return qd times the slope of what is no rigid torque."""
        state, h = self.state, SMALL
        rest, ahead = self.torque - self.load, _state(state.q, state.qd * (1 + h), state.qdd)
        more = self._of(self.basis, self.X, ahead) - self._of(*self.rigid, ahead)
        return np.asarray((more - rest) / h)

    def _of(self, basis: Basis, X: Array, state: State) -> Array:
        return combined(basis.explicit(replace(state, conditions=self.state.conditions)), X, np.zeros(state.q.shape))


def tree_of(basis: Basis) -> KinematicTree | None:
    """Return the tree of a robot's links; None if they are no tree's."""
    return next((block.tree for block in basis.blocks if isinstance(block, TreeLinks)), None)


def on_tree(basis: Basis, tree: KinematicTree) -> Basis:
    """Return a basis whose links are those of another tree."""
    blocks = tuple(replace(block, tree=tree) if isinstance(block, TreeLinks) else block for block in basis.blocks)
    return replace(basis, blocks=blocks)


def _state(q: Array, qd: Array, qdd: Array) -> State:
    return State(q, qd, lambda _: qdd)
