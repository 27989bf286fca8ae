"""A block of some joints."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Self, final

from idbench.identify.arrays import Array
from idbench.identify.basis.block import AbstractBlock, BlockColumns
from idbench.identify.basis.parameter import Parameter
from idbench.identify.signals.state import State

if TYPE_CHECKING:
    from idbench.identify.basis.basis import Basis


@final
@dataclass(frozen=True)
class OfJoints(AbstractBlock):
    """A block, the parameters of some joints of it alone: friction that differs from joint to joint."""

    block: AbstractBlock
    """Any."""
    joints: tuple[int, ...]
    """From 0."""

    def parameters(self, n: int) -> tuple[Parameter, ...]:
        """Return those of the joints."""
        return tuple(p for p in self.block.parameters(n) if p.joint in self.joints)

    def explicit(self, state: State) -> BlockColumns:
        """Return the columns of the joint torques."""
        return self._of(self.block.explicit(state))

    def momentum(self, state: State) -> BlockColumns:
        """Return the columns of the momenta."""
        return self._of(self.block.momentum(state))

    def remainder(self, state: State) -> BlockColumns:
        """Return the columns of the torques that are no derivative of a momentum."""
        return self._of(self.block.remainder(state))

    def energy(self, state: State) -> BlockColumns:
        """Return the columns of the energy."""
        return self._of(self.block.energy(state))

    def dissipation(self, state: State) -> BlockColumns:
        """Return the columns of the dissipated power."""
        return self._of(self.block.dissipation(state))

    @property
    def is_nonlinear(self) -> bool:
        """Whether the block is."""
        return self.block.is_nonlinear

    def adapted(self, basis: "Basis", X: Array) -> Self:
        """Return the block about an estimate."""
        return replace(self, block=self.block.adapted(basis, X))

    def operating_point(self, n: int) -> Mapping[Parameter, Array | float]:
        """Return the operating point of the joints' nonlinear parameters."""
        return {
            parameter: value for parameter, value in self.block.operating_point(n).items() if parameter.joint in self.joints
        }

    def _of(self, columns: BlockColumns) -> BlockColumns:
        return {address: column for address, column in columns.items() if address[1].joint in self.joints}


def inner_of(block: AbstractBlock) -> AbstractBlock:
    """Return a block as it is of all joints."""
    return block.block if isinstance(block, OfJoints) else block
