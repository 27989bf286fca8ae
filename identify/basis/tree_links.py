"""The links of any tree of hinges and slides."""

from collections.abc import Callable, Set
from dataclasses import dataclass, replace
from functools import cache
from typing import Self, TypeAlias, final

import numpy as np

from idbench.identify.basis.block import AbstractConservativeBlock, BlockColumns
from idbench.identify.basis.body_regressor import KINDS, Wrench, energy
from idbench.identify.basis.parameter import Parameter
from idbench.identify.basis.terms import Term, is_zero, minus
from idbench.identify.basis.twists import Twists
from idbench.identify.data.kinematics import KinematicTree
from idbench.identify.errors import SettingError
from idbench.identify.signals.state import State

Pairs: TypeAlias = tuple[tuple[int, int], ...]


@final
@dataclass(frozen=True)
class TreeLinks(AbstractConservativeBlock):
    """Rigid links of a tree, ten parameters each: XX1 XY1 XZ1 YY1 YZ1 ZZ1 MX1 MY1 MZ1 M1, XX2, ...

    The inertia matrix and the first moments are about the origin of the link's frame, in its axes. By Newton and Euler, and by
    Lagrange for the columns of the implicit and power models: with V_j the twist of link j, T_j = V_j' P_j / 2 and

        p_i = sum_j (dV_j/dqd_i)' P_j        remainder_i = sum_j -(dV_j/dq_i)' P_j + gravity
    """

    tree: KinematicTree
    """The robot."""
    only: frozenset[Parameter] | None = None
    """Parameters whose columns are computed; all by default."""

    def parameters(self, n: int) -> tuple[Parameter, ...]:
        """Return ten parameters for each link that has mass; raise SettingError unless the tree has `n` joints."""
        if n != self.tree.n:
            raise SettingError(f"robot {self.tree.name!r} has {self.tree.n} joints, not {n}")
        return tuple(parameter for j in self._massive for parameter in _parameters(j))

    def narrowed(self, parameters: Set[Parameter]) -> Self:
        """Return this block without the work for other parameters."""
        return replace(self, only=frozenset(parameters))

    def explicit(self, state: State) -> BlockColumns:
        """Return D (Eq. 5, 6)."""
        at = state.shared(self.tree, self._twists)
        force = {j: Wrench.inertial(at.velocity[j], at.acceleration[j], at.up[j]) for j in self._massive}
        return self._columns(state, self._pairs, lambda i, j, x: force[j].along(at.unit[j][i], x))

    def momentum(self, state: State) -> BlockColumns:
        """Return M_i(q) qd (Eq. 9)."""
        at = state.shared(self.tree, self._twists)
        momentum = {j: Wrench.momentum(at.velocity[j]) for j in self._massive}
        return self._columns(state, self._pairs, lambda i, j, x: momentum[j].along(at.unit[j][i], x))

    def remainder(self, state: State) -> BlockColumns:
        """Return R_i(q, qd) = -dT_i/dq + dU_i/dq (Eq. 8, 9)."""
        at = state.shared(self.tree, self._twists)
        momentum = {j: Wrench.momentum(at.velocity[j]) for j in self._massive}
        weight = {j: Wrench.weight(at.up[j]) for j in self._massive}

        def column(i: int, j: int, x: int) -> Term:
            return minus(weight[j].along(at.unit[j][i], x), momentum[j].along(at.slope[j][i], x))

        return self._columns(state, self._pairs, column)

    def energy(self, state: State) -> BlockColumns:
        """Return h_i(q, qd) (Eq. 10)."""
        at = state.shared(self.tree, self._twists)
        stored = {j: energy(at.velocity[j], at.up[j], at.height[j]) for j in self._massive}
        return self._columns(state, tuple((0, j) for j in self._massive), lambda _, j, x: stored[j][x])

    def _twists(self, state: State) -> Twists:
        return Twists(self.tree, state)

    @property
    def _massive(self) -> tuple[int, ...]:
        return tuple(j for j, joint in enumerate(self.tree.joints) if joint.massive)

    @property
    def _pairs(self) -> Pairs:
        """(joint, link that it moves)."""
        return tuple((i, j) for j in self._massive for i in self.tree.ancestors(j))

    def _columns(
        self, state: State, rows: tuple[tuple[int, int], ...], column: Callable[[int, int, int], Term]
    ) -> BlockColumns:
        """Return the columns of (row, link) that are asked for and not zero at all times."""
        shape, found = state.q[..., 0, :].shape, {}
        for i, j in rows:
            for x, parameter in enumerate(_parameters(j)):
                if (self.only is None or parameter in self.only) and not is_zero(term := column(i, j, x)):
                    found[i, parameter] = np.broadcast_to(term, shape)
        return found


@cache
def _parameters(j: int) -> tuple[Parameter, ...]:
    """Return the ten parameters of a link."""
    return tuple(Parameter(x, j, *what) for x, what in KINDS.items())
