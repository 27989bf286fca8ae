"""A block of some joints."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Self

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.basis.block import AbstractBlock, AbstractColumns, BlockColumns, Parameter
from idbench.identify.data.kinematics import Coupling
from idbench.identify.signals.signals import State

if TYPE_CHECKING:
    from idbench.identify.basis.basis import Basis


@dataclass(frozen=True)
class OfJoints(AbstractColumns):
    """A block, the parameters of some joints of it alone: friction that differs from joint to joint."""

    block: AbstractBlock
    """Any."""
    joints: tuple[int, ...]
    """From 0."""

    def parameters(self, n: int) -> tuple[Parameter, ...]:
        """Return those of the joints."""
        return tuple(p for p in self.block.parameters(n) if p.joint in self.joints)

    def columns(self, function: str, state: State) -> BlockColumns:
        """Return the block's columns of the joints' parameters."""
        columns: BlockColumns = getattr(self.block, function)(state)
        return {address: column for address, column in columns.items() if address[1].joint in self.joints}

    @property
    def is_nonlinear(self) -> bool:
        """Whether the block is."""
        return self.block.is_nonlinear

    def adapted(self, basis: "Basis", X: Array) -> Self:
        """Return the block about an estimate."""
        return replace(self, block=self.block.adapted(basis, X))

    def operating_point(self, n: int) -> Mapping[Parameter, Array | float]:
        """Return the operating point of the joints' nonlinear parameters."""
        return {p: value for p, value in self.block.operating_point(n).items() if p.joint in self.joints}


def block_of_all_joints(block: AbstractBlock) -> AbstractBlock:
    """Return a block as it is of all joints."""
    return block.block if isinstance(block, OfJoints) else block


@dataclass(frozen=True, eq=False)
class Coupled(AbstractColumns):
    """What a drive adds whose motor turns with several joints, theta = weights' q: its rotor, its frictions, a spring.

    A torque of the motor acts on each of the joints with the joint's weight, the dual of how positions add up: the columns are
    weights times those of one joint that moves as the motor does.
    """

    block: AbstractBlock
    """What the drive has, as of a single joint."""
    coupling: Coupling
    """With which joints it turns."""

    def parameters(self, n: int) -> tuple[Parameter, ...]:
        """Return those of the block, of the drive instead of a joint."""
        return tuple(map(self._own, self.block.parameters(1)))

    def columns(self, function: str, state: State) -> BlockColumns:
        """Return the motor's energy and power as they are, its torques and momenta in the row of each joint that it turns."""
        columns: BlockColumns = getattr(self.block, function)(self._motor(state))
        if function in ("energy", "dissipation"):
            return {(row, self._own(p)): x for (row, p), x in columns.items()}
        weights = self.coupling.weights
        return {(j, self._own(p)): weights[j] * x for (_, p), x in columns.items() for j in np.flatnonzero(weights).tolist()}

    def _motor(self, state: State) -> State:
        """Return the motion of the motor."""

        def along(x: Array) -> Array:
            return np.sum(np.asarray(self.coupling.weights)[:, None] * x, axis=-2, keepdims=True)

        return State(along(state.q), along(state.qd), lambda _: along(state.qdd))

    def _own(self, parameter: Parameter) -> Parameter:
        return replace(parameter, joint=None, drive=self.coupling.name)
