"""What the last link holds."""

from collections.abc import Set
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self, final

import numpy as np

from idbench.identify.basis.block import AbstractConservativeBlock, BlockColumns
from idbench.identify.basis.parameter import Parameter
from idbench.identify.basis.tree_links import TreeLinks
from idbench.identify.data.kinematics import KinematicTree
from idbench.identify.errors import SettingError
from idbench.identify.signals.state import State

HELD_SHARE = "payload"
"""Condition of a log: the share of the payload that is held, 0 without and 1 with it."""


@final
@dataclass(frozen=True, eq=False)
class PayloadLink(AbstractConservativeBlock):
    """A payload on a link, XXL XYL XZL YYL YZL ZZL MXL MYL MZL ML in the frame of the link, in the logs that have it.

    W. Khalil, M. Gautier and P. Lemoine, "Identification of the payload inertial parameters of industrial manipulators", IEEE
    ICRA 2007.
    """

    tree: KinematicTree
    """The robot."""
    link: int
    """Number of the joint whose link holds it, from 0."""
    only: frozenset[Parameter] | None = None
    """Parameters whose columns are computed; all by default."""

    def parameters(self, n: int) -> tuple[Parameter, ...]:
        """Return the ten parameters; raise SettingError unless the tree has `n` joints."""
        own = [p for p in self._links.parameters(n) if p.joint == self.link]
        if not own:
            raise SettingError(f"joint {self.tree.joints[self.link].name} moves no link with mass that could hold a payload")
        return tuple(map(_own, own))

    def narrowed(self, parameters: Set[Parameter]) -> Self:
        """Return this block without the work for other parameters."""
        return replace(self, only=frozenset(parameters))

    def explicit(self, state: State) -> BlockColumns:
        """Return D of the payload (Eq. 5, 6)."""
        return self._held(state, self._links.explicit(state))

    def momentum(self, state: State) -> BlockColumns:
        """Return its momenta (Eq. 9)."""
        return self._held(state, self._links.momentum(state))

    def remainder(self, state: State) -> BlockColumns:
        """Return its torques that are no derivative of a momentum (Eq. 8, 9)."""
        return self._held(state, self._links.remainder(state))

    def energy(self, state: State) -> BlockColumns:
        """Return its energy (Eq. 10)."""
        return self._held(state, self._links.energy(state))

    def _held(self, state: State, columns: BlockColumns) -> BlockColumns:
        share = state.condition(HELD_SHARE)[..., 0, :]
        if not np.any(share):
            return {}
        return {(row, _own(parameter)): share * column for (row, parameter), column in columns.items()}

    @cached_property
    def _links(self) -> TreeLinks:
        own = (p for p in TreeLinks(self.tree).parameters(self.tree.n) if p.joint == self.link)
        return TreeLinks(self.tree, frozenset(p for p in own if self.only is None or _own(p) in self.only))


def _own(parameter: Parameter) -> Parameter:
    """Return the parameter of the payload that is what one of the link is: MXL of MX6."""
    return replace(parameter, symbol=f"{parameter.symbol}L", joint=None)
