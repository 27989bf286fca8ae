"""Column blocks: what a robot's basis is a sum of."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Set
from typing import TYPE_CHECKING, Protocol, TypeAlias, final, runtime_checkable

from idbench.identify.arrays import Array
from idbench.identify.basis.parameter import Parameter
from idbench.identify.signals.state import State

if TYPE_CHECKING:
    from idbench.identify.basis.basis import Basis

BlockColumns: TypeAlias = Mapping[tuple[int, Parameter], Array]
"""Columns of a block that are not identically zero: (row of an instant, parameter) -> signal (..., time)."""


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
    def explicit(self, state: State) -> BlockColumns:
        """Return the columns D(q, qd, qdd) of the joint torques (Eq. 5, 6)."""

    def momentum(self, state: State) -> BlockColumns:
        """Return the columns M_i(q) qd of the momenta, still to be differentiated (Eq. 9); none by default."""
        del state
        return {}

    def remainder(self, state: State) -> BlockColumns:
        """Return the columns R_i(q, qd) of the torques that are no derivative of a momentum (Eq. 8, 9); none by default."""
        del state
        return {}

    def energy(self, state: State) -> BlockColumns:
        """Return the columns h_i(q, qd) of the energy in row 0, still to be differentiated (Eq. 10); none by default."""
        del state
        return {}

    def dissipation(self, state: State) -> BlockColumns:
        """Return the columns of the dissipated power qd' Gamma_f in row 0 (Eq. 10); none by default."""
        del state
        return {}

    @property
    def is_nonlinear(self) -> bool:
        """Whether columns depend on parameters, so that the block holds about an estimate alone: see `adapted`."""
        return False

    def adapted(self, basis: "Basis", X: Array) -> "AbstractBlock":
        """Return the block about an estimate X, shape (..., p), in a basis that has it: ``basis.value(parameter, X)``."""
        del basis, X
        return self

    def operating_point(self, n: int) -> Mapping[Parameter, Array | float]:
        """Return the operating point of nonlinear parameters, shape (...): their columns are derivatives there."""
        del n
        return {}


@runtime_checkable
class Narrowing(Protocol):
    """A block that can spare itself the columns that nobody asks for."""

    def narrowed(self, parameters: Set[Parameter]) -> AbstractBlock:
        """Return the block without the work for other parameters."""


class AbstractConservativeBlock(AbstractBlock):
    """A block that stores energy and dissipates none: rigid bodies, rotors, springs."""

    @final
    def dissipation(self, state: State) -> BlockColumns:
        """Return no columns."""
        return super().dissipation(state)
