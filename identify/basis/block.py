"""Column blocks: what a robot's basis is a sum of."""

from abc import ABC, abstractmethod
from typing import ClassVar, Protocol, final, runtime_checkable

import numpy as np

from identify.arrays import Array, Columns
from identify.basis.parameter import Kind, Parameter
from identify.blame import expect
from identify.errors import SettingError
from identify.signals.state import State


class AbstractBlock(ABC):
    """Named columns of a robot, linear in its parameters, as the three models need them.

    Every function takes a state, signals of shape (..., joint, time), and returns the columns that are not identically
    zero, (row of an instant, parameter) -> (..., time). For all states, with s = d/dt,

        explicit = s momentum + remainder          qd' explicit = s energy + dissipation

    which is what makes the three models equivalent.
    """

    @abstractmethod
    def parameters(self, n: int) -> tuple[Parameter, ...]:
        """Return the parameters of this block for a robot of `n` joints."""

    @abstractmethod
    def explicit(self, state: State) -> Columns:
        """Return the columns D(q, qd, qdd) of the joint torques (Eq. 5, 6)."""

    @abstractmethod
    def momentum(self, state: State) -> Columns:
        """Return the columns M_i(q) qd of the momenta, still to be differentiated (Eq. 9)."""

    @abstractmethod
    def remainder(self, state: State) -> Columns:
        """Return the columns R_i(q, qd) of the torques that are not the derivative of a momentum (Eq. 8, 9)."""

    @abstractmethod
    def energy(self, state: State) -> Columns:
        """Return the columns h_i(q, qd) of kinetic plus potential energy in row 0, still to be differentiated (Eq. 10)."""

    @abstractmethod
    def dissipation(self, state: State) -> Columns:
        """Return the columns of the dissipated power qd' Gamma_f in row 0 (Eq. 10)."""


@runtime_checkable
class Narrowing(Protocol):
    """A block that can spare itself the columns that nobody asks for."""

    def narrowed(self, names: frozenset[str]) -> AbstractBlock:
        """Return the block without the work for parameters that are not in `names`."""


class AbstractConservativeBlock(AbstractBlock):
    """A block that stores energy and dissipates none: rigid bodies, rotors, springs."""

    @final
    def dissipation(self, state: State) -> Columns:
        """Return no columns."""
        del state
        return {}


class AbstractFriction(AbstractBlock):
    """A friction law of every joint, with one parameter a joint; all that a law has to say is `force`.

    A law with two coefficients is the sum of two blocks.
    """

    symbol: ClassVar[str]
    """Letters of the parameter; the joint's number, from 1, follows them."""

    unit: ClassVar[str]
    """Unit of the parameter."""

    kind: ClassVar[Kind] = "friction"
    """What the parameter measures."""

    @abstractmethod
    def force(self, q: Array, qd: Array) -> Array:
        """Return the friction torque of a unit parameter, (..., joint, time), positive when it resists qd > 0."""

    @final
    def parameters(self, n: int) -> tuple[Parameter, ...]:
        """Return a parameter for each joint."""
        return tuple(Parameter(f"{self.symbol}{j + 1}", j, self.kind, self.unit) for j in range(n))

    @final
    def explicit(self, state: State) -> Columns:
        """Return the force columns: joint j's parameter in row j."""
        return self.remainder(state)

    @final
    def momentum(self, state: State) -> Columns:
        """Return no columns."""
        del state
        return {}

    @final
    def remainder(self, state: State) -> Columns:
        """Return the force columns: joint j's parameter in row j."""
        force = self._checked(state)
        return {(j, p.name): force[..., j, :] for j, p in enumerate(self.parameters(state.n))}

    @final
    def energy(self, state: State) -> Columns:
        """Return no columns."""
        del state
        return {}

    @final
    def dissipation(self, state: State) -> Columns:
        """Return qd_j times the force of joint j, in row 0."""
        power = state.qd * self._checked(state)
        return {(0, p.name): power[..., j, :] for j, p in enumerate(self.parameters(state.n))}

    def _checked(self, state: State) -> Array:
        """Return the force; raise SettingError if it is not finite, PluginError if it is no array like the velocities."""
        force = expect(self, "force", self.force(state.q, state.qd), state.qd.shape)
        if not np.isfinite(force).all():
            k = np.argwhere(~np.isfinite(force))[0]
            q, qd = state.q[tuple(k)], state.qd[tuple(k)]
            raise SettingError(
                f"friction law {type(self).__name__} gives {force[tuple(k)]} at q = {q:.4g}, qd = {qd:.4g}: let it be finite "
                "for all of them, also at rest"
            )
        return force
