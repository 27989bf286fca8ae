"""Friction that grows with the load."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from idbench.identify.arrays import Array, combined
from idbench.identify.basis.basis import Basis
from idbench.identify.basis.block import RIGID, AbstractWithoutMomentum, BlockColumns, Kind, Parameter
from idbench.identify.basis.joint_law import AbstractJointLaw
from idbench.identify.data.kinematics import Coupling
from idbench.identify.signals.signals import State


@dataclass(frozen=True, eq=False)
class TiedFriction(AbstractWithoutMomentum):
    """Coulomb friction between joints that one motor drives: each resists as the others turn, Fsx sign(qd6) on joint 5.

    In wrists whose gears run through each other: the tied friction of M. Gautier's models of RX and TX robots, as in J. Swevers
    et al., "Dynamic model identification for industrial robots", IEEE Control Systems Magazine 27 (2007) 58-71.
    """

    coupling: Coupling
    """The joints, with their weights."""

    def parameters(self, n: int) -> tuple[Parameter, ...]:
        """Return Fsx."""
        return (self._own,)

    def remainder(self, state: State) -> BlockColumns:
        """Return the signs of the velocities of the other joints."""
        weights = np.array(self.coupling.weights)
        each = weights[:, None] * np.sign(state.qd)
        others = np.sum(each, axis=-2, keepdims=True) - each
        return {(int(j), self._own): weights[j] * others[..., j, :] for j in np.flatnonzero(weights)}

    def dissipation(self, state: State) -> BlockColumns:
        """Return the power of the torques."""
        power = state.qd[..., 0, :] * 0.0
        for (j, _), torque in self.remainder(state).items():
            power = power + state.qd[..., j, :] * torque
        return {(0, self._own): power}

    @property
    def _own(self) -> Parameter:
        return Parameter("Fsx", None, "friction", "N m", self.coupling.name)


@dataclass(frozen=True)
class LoadFriction(AbstractJointLaw):
    """Friction in proportion to the torque that a joint carries, Fl |load| sign(qd).

    The load is all torque but friction, gravity and inertia of links and rotors (which cannot be told apart at every joint), by
    the estimate before: P. Hamon, M. Gautier and P. Garrec, "Dynamic identification of robots with a dry friction model
    depending on load and velocity", IROS 2010. As long as there is none, it is that of a unit inertia.
    """

    is_nonlinear: ClassVar[bool] = True

    bodies: Basis | None = None
    """The rigid bodies and rotors."""
    X: Array | None = None
    """Their parameters, as estimated before, shape (..., p)."""

    def letters(self) -> Mapping[str, tuple[Kind, str]]:
        """Return Fl."""
        return {"Fl": ("friction", "1")}

    def torques(self, state: State) -> Mapping[str, Array]:
        """Return |load| sign(qd)."""
        return {"Fl": np.abs(self.load(state)) * np.sign(state.qd)}

    def load(self, state: State) -> Array:
        """Return the torque that each joint carries [N m], shape (..., joint, time)."""
        if self.bodies is None or self.X is None:
            return state.qdd
        return combined(state.latest(self.bodies, self.bodies.explicit), self.X, np.zeros(state.q.shape))

    def adapted(self, basis: Basis, X: Array) -> Self:
        """Return the law with the load of an estimate."""
        bodies = basis.only(RIGID)
        if self.bodies is not None and self.bodies.parameters == bodies.parameters:
            bodies = self.bodies  # whose columns are kept
        x = X[..., [basis.places[parameter] for parameter in bodies.parameters]]
        known = np.isfinite(x).all(axis=-1, keepdims=True)
        if self.X is None and not known.any():
            return self
        return replace(self, bodies=bodies, X=np.where(known, x, 0.0 if self.X is None else self.X))
