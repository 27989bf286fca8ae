"""Springs."""

from dataclasses import dataclass
from typing import final

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.basis.block import AbstractConservativeBlock, BlockColumns
from idbench.identify.basis.parameter import Parameter
from idbench.identify.errors import SettingError
from idbench.identify.signals.state import State


@final
@dataclass(frozen=True)
class Spring(AbstractConservativeBlock):
    """Springs of joints, K (q - rest); where the rest position is not known, `offset` takes its torque."""

    rest: tuple[float, ...] = (0.0,)
    """Position without a torque [rad or m], of all joints or of each."""
    joints: tuple[int, ...] | None = None
    """Joints that have one, from 0; all by default."""

    def parameters(self, n: int) -> tuple[Parameter, ...]:
        """Return K of each joint that has a spring."""
        return tuple(map(_stiffness, self._numbers(n)))

    def explicit(self, state: State) -> BlockColumns:
        """Return q - rest."""
        return self.remainder(state)

    def momentum(self, state: State) -> BlockColumns:
        """Return no columns."""
        del state
        return {}

    def remainder(self, state: State) -> BlockColumns:
        """Return q - rest."""
        return {(j, _stiffness(j)): self._bent(state, j) for j in self._numbers(state.n)}

    def energy(self, state: State) -> BlockColumns:
        """Return (q - rest)^2 / 2."""
        return {(0, _stiffness(j)): 0.5 * self._bent(state, j) ** 2 for j in self._numbers(state.n)}

    def _bent(self, state: State, j: int) -> Array:
        if len(self.rest) not in (1, state.n):
            raise SettingError(f"{len(self.rest)} rest positions of springs for {state.n} joints: give one, or one per joint")
        return state.q[..., j, :] - np.broadcast_to(self.rest, (state.n,))[j]

    def _numbers(self, n: int) -> tuple[int, ...]:
        return tuple(range(n)) if self.joints is None else self.joints


def _stiffness(j: int) -> Parameter:
    return Parameter("K", j, "stiffness", "N m/rad")
