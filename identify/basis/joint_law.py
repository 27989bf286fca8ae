"""Laws of a joint: torques that depend on its own motion, or load, alone."""

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.basis.block import AbstractConservativeBlock, AbstractWithoutMomentum, BlockColumns, Kind, Parameter
from idbench.identify.basis.symbols import SymbolArray
from idbench.identify.blame import expect
from idbench.identify.errors import SettingError
from idbench.identify.signals.signals import State


class AbstractJointLaw(AbstractWithoutMomentum):
    """A law of every joint whose torque stands in the row of the joint alone; a law may have several parameters a joint."""

    asks: ClassVar[str] = ""
    """A setting without a default that could be meant: what it is, with a number for an example; empty if there is none."""

    @abstractmethod
    def letters(self) -> Mapping[str, tuple[Kind, str]]:
        """Return kind and unit of the parameters, by their letters; the joint's number, from 1, follows them."""

    @abstractmethod
    def torques(self, state: State) -> Mapping[str, Array]:
        """Return the torque of a unit parameter by its letters, shape (..., joint, time), positive when it resists qd > 0."""

    @final
    def parameters(self, n: int) -> tuple[Parameter, ...]:
        """Return the parameters of each joint."""
        return tuple(Parameter(x, j, *what) for j in range(n) for x, what in self.letters().items())

    @final
    def remainder(self, state: State) -> BlockColumns:
        """Return the torques: joint j's parameters in row j."""
        found = self._checked(state)
        return {(p.joint or 0, p): found[p.symbol][..., p.joint, :] for p in self.parameters(state.n)}

    @final
    def dissipation(self, state: State) -> BlockColumns:
        """Return qd_j times the torques of joint j, in row 0."""
        found = {x: state.qd * torque for x, torque in self._checked(state).items()}
        return {(0, p): found[p.symbol][..., p.joint, :] for p in self.parameters(state.n)}

    def _checked(self, state: State) -> dict[str, Array]:
        """Return the torques; raise SettingError if one is not finite, PluginError if it is no array like the velocities."""
        if isinstance(state.q, SymbolArray):  # which has no values that could be wrong
            return dict(self.torques(state))
        found = {x: expect(self, "force", torque, state.qd.shape) for x, torque in self.torques(state).items()}
        for torque in found.values():
            if not np.isfinite(torque).all():
                k = np.argwhere(~np.isfinite(torque))[0]
                q, qd = state.q[tuple(k)], state.qd[tuple(k)]
                raise SettingError(
                    f"friction law {type(self).__name__} gives {torque[tuple(k)]} at q = {q:.4g}, qd = {qd:.4g}: let it be "
                    "finite for all of them, also at rest"
                )
        return found


class AbstractFriction(AbstractJointLaw):
    """A friction law of every joint, with one parameter a joint; all that a law has to say is `force`."""

    symbol: ClassVar[str]
    """Letters of the parameter; the joint's number, from 1, follows them."""
    unit: ClassVar[str]
    """Unit of the parameter."""
    kind: ClassVar[Kind] = "friction"
    """What the parameter measures."""
    replaces: ClassVar[str] = ""
    """Letters of the law in whose place this one stands, if it stands in the place of one."""

    @abstractmethod
    def force(self, q: Array, qd: Array) -> Array:
        """Return the friction torque of a unit parameter, (..., joint, time), positive when it resists qd > 0."""

    @final
    def letters(self) -> Mapping[str, tuple[Kind, str]]:
        """Return the one."""
        return {self.symbol: (self.kind, self.unit)}

    @final
    def torques(self, state: State) -> Mapping[str, Array]:
        """Return the force."""
        return {self.symbol: self.force(state.q, state.qd)}


@dataclass(frozen=True)
class Armature(AbstractConservativeBlock):
    """Inertia of a rotor, seen at its joint: Ia qdd, in the row of the joint alone.

    Of a rotor that turns fast behind a gear; the small torques it makes when its housing turns are left out, as in MuJoCo.
    """

    def parameters(self, n: int) -> tuple[Parameter, ...]:
        """Return Ia of each joint."""
        return tuple(map(_rotor, range(n)))

    def explicit(self, state: State) -> BlockColumns:
        """Return qdd (Eq. 5, 6)."""
        return {(j, _rotor(j)): state.qdd[..., j, :] for j in range(state.n)}

    def momentum(self, state: State) -> BlockColumns:
        """Return qd (Eq. 9)."""
        return {(j, _rotor(j)): state.qd[..., j, :] for j in range(state.n)}

    def energy(self, state: State) -> BlockColumns:
        """Return qd^2 / 2 (Eq. 10)."""
        return {(0, _rotor(j)): 0.5 * state.qd[..., j, :] ** 2 for j in range(state.n)}


def _rotor(j: int) -> Parameter:
    return Parameter("Ia", j, "rotor inertia", "kg m^2")
