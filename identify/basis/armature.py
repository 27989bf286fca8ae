"""Inertia of rotors."""

from dataclasses import dataclass
from typing import final

from idbench.identify.basis.block import AbstractConservativeBlock, BlockColumns
from idbench.identify.basis.parameter import Parameter
from idbench.identify.signals.state import State


@final
@dataclass(frozen=True)
class Armature(AbstractConservativeBlock):
    """Inertia of a rotor, seen at its joint: Ia qdd, in the row of the joint alone.

    Of a rotor that turns fast behind a gear; the small torques it makes when its housing turns are left out, as in MuJoCo.
    """

    joints: tuple[int, ...] | None = None
    """Joints that have one, from 0; all by default."""

    def parameters(self, n: int) -> tuple[Parameter, ...]:
        """Return Ia of each joint that has one."""
        return tuple(map(_rotor, self._numbers(n)))

    def explicit(self, state: State) -> BlockColumns:
        """Return qdd (Eq. 5, 6)."""
        return {(j, _rotor(j)): state.qdd[..., j, :] for j in self._numbers(state.n)}

    def momentum(self, state: State) -> BlockColumns:
        """Return qd (Eq. 9)."""
        return {(j, _rotor(j)): state.qd[..., j, :] for j in self._numbers(state.n)}

    def remainder(self, state: State) -> BlockColumns:
        """Return no columns."""
        del state
        return {}

    def energy(self, state: State) -> BlockColumns:
        """Return qd^2 / 2 (Eq. 10)."""
        return {(0, _rotor(j)): 0.5 * state.qd[..., j, :] ** 2 for j in self._numbers(state.n)}

    def _numbers(self, n: int) -> tuple[int, ...]:
        return tuple(range(n)) if self.joints is None else self.joints


def _rotor(j: int) -> Parameter:
    return Parameter("Ia", j, "rotor inertia", "kg m^2")
