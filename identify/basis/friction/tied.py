"""Friction that joints with one motor have in common."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, final

import numpy as np

from idbench.identify.basis.block import AbstractBlock, BlockColumns
from idbench.identify.basis.parameter import Parameter
from idbench.identify.data.kinematics import Coupling
from idbench.identify.signals.state import State

if TYPE_CHECKING:
    from idbench.identify.arrays import Array


@final
@dataclass(frozen=True, eq=False)
class TiedFriction(AbstractBlock):
    """Coulomb friction between joints that one motor drives: each resists as the others turn, Fsx sign(qd6) on joint 5.

    In wrists whose gears run through each other: the tied friction of M. Gautier's models of RX and TX robots, as in J. Swevers
    et al., "Dynamic model identification for industrial robots", IEEE Control Systems Magazine 27 (2007) 58-71.
    """

    coupling: Coupling
    """The joints, with their weights."""

    def parameters(self, n: int) -> tuple[Parameter, ...]:
        """Return Fsx."""
        del n
        return (self._own,)

    def explicit(self, state: State) -> BlockColumns:
        """Return the signs of the velocities of the other joints."""
        return self.remainder(state)

    def momentum(self, state: State) -> BlockColumns:
        """Return no columns."""
        del state
        return {}

    def remainder(self, state: State) -> BlockColumns:
        """Return the signs of the velocities of the other joints."""
        weights = np.array(self.coupling.weights)
        each = weights[:, None] * np.sign(state.qd)
        others = np.sum(each, axis=-2, keepdims=True) - each
        return {(int(j), self._own): weights[j] * others[..., j, :] for j in np.flatnonzero(weights)}

    def energy(self, state: State) -> BlockColumns:
        """Return no columns."""
        del state
        return {}

    def dissipation(self, state: State) -> BlockColumns:
        """Return the power of the torques."""
        power: Array = np.sum([state.qd[..., j, :] * x for (j, _), x in self.remainder(state).items()], axis=0)
        return {(0, self._own): power}

    @property
    def _own(self) -> Parameter:
        return Parameter("Fsx", None, "friction", "N m", self.coupling.name)
