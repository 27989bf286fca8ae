"""A drive that turns with several joints."""

from dataclasses import dataclass, replace
from typing import final

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.basis.block import AbstractBlock, BlockColumns
from idbench.identify.basis.parameter import Parameter
from idbench.identify.data.kinematics import Coupling
from idbench.identify.signals.state import State


@final
@dataclass(frozen=True, eq=False)
class Coupled(AbstractBlock):
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
        del n
        return tuple(map(self._own, self.block.parameters(1)))

    def explicit(self, state: State) -> BlockColumns:
        """Return the columns of the joint torques."""
        return self._of_joints(self.block.explicit(self._motor(state)))

    def momentum(self, state: State) -> BlockColumns:
        """Return the columns of the momenta."""
        return self._of_joints(self.block.momentum(self._motor(state)))

    def remainder(self, state: State) -> BlockColumns:
        """Return the columns of the torques that are no derivative of a momentum."""
        return self._of_joints(self.block.remainder(self._motor(state)))

    def energy(self, state: State) -> BlockColumns:
        """Return the columns of the energy."""
        return {(row, self._own(p)): x for (row, p), x in self.block.energy(self._motor(state)).items()}

    def dissipation(self, state: State) -> BlockColumns:
        """Return the columns of the dissipated power."""
        return {(row, self._own(p)): x for (row, p), x in self.block.dissipation(self._motor(state)).items()}

    def _motor(self, state: State) -> State:
        """Return the motion of the motor."""

        def along(x: Array) -> Array:
            return np.sum(np.asarray(self.coupling.weights)[:, None] * x, axis=-2, keepdims=True)

        return State(along(state.q), along(state.qd), lambda _: along(state.qdd))

    def _of_joints(self, columns: BlockColumns) -> BlockColumns:
        found = {}
        for (_, parameter), column in columns.items():
            for j, weight in enumerate(self.coupling.weights):
                if weight:
                    found[j, self._own(parameter)] = weight * column
        return found

    def _own(self, parameter: Parameter) -> Parameter:
        return replace(parameter, joint=None, drive=self.coupling.name)
