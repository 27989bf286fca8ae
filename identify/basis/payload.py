"""What the last link holds."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self, final

import numpy as np

from identify.arrays import Columns
from identify.basis.block import AbstractConservativeBlock
from identify.basis.parameter import Parameter
from identify.basis.tree_links import TreeLinks
from identify.data.kinematics import INERTIAL, KinematicTree
from identify.errors import SettingError
from identify.signals.state import State

HELD_SHARE = "payload"
"""Condition of a log: the share of the payload that is held, 0 without and 1 with it."""


@final
@dataclass(frozen=True, eq=False)
class PayloadLink(AbstractConservativeBlock):
    """A payload on a link, XXL XYL XZL YYL YZL ZZL MXL MYL MZL ML in the frame of the link, in the logs that have it.

    W. Khalil, M. Gautier and P. Lemoine, "Identification of the payload inertial parameters of industrial manipulators", IEEE
    ICRA 2007.

    Parameters
    ----------
    tree : KinematicTree
        The robot.
    link : int
        Number of the joint whose link holds it, from 0.
    only : frozenset of str, optional
        Parameters whose columns are computed; all by default.
    """

    tree: KinematicTree
    link: int
    only: frozenset[str] | None = None

    def parameters(self, n: int) -> tuple[Parameter, ...]:
        """Return the ten parameters; raise SettingError unless the tree has `n` joints."""
        own = [p for p in self._links.parameters(n) if p.joint == self.link]
        if not own:
            raise SettingError(f"joint {self.tree.joints[self.link].name} moves no link with mass that could hold a payload")
        return tuple(replace(p, name=f"{letters}L", joint=None) for letters, p in zip(INERTIAL, own, strict=True))

    def narrowed(self, names: frozenset[str]) -> Self:
        """Return this block without the work for other parameters."""
        return replace(self, only=names)

    def explicit(self, state: State) -> Columns:
        """Return D of the payload (Eq. 5, 6)."""
        return self._held(state, self._links.explicit(state))

    def momentum(self, state: State) -> Columns:
        """Return its momenta (Eq. 9)."""
        return self._held(state, self._links.momentum(state))

    def remainder(self, state: State) -> Columns:
        """Return its torques that are no derivative of a momentum (Eq. 8, 9)."""
        return self._held(state, self._links.remainder(state))

    def energy(self, state: State) -> Columns:
        """Return its energy (Eq. 10)."""
        return self._held(state, self._links.energy(state))

    def _held(self, state: State, columns: Columns) -> Columns:
        share = state.condition(HELD_SHARE)[..., 0, :]
        if not np.any(share):
            return {}
        return {(row, self._names[name]): share * column for (row, name), column in columns.items()}

    @cached_property
    def _names(self) -> dict[str, str]:
        return {f"{letters}{self.link + 1}": f"{letters}L" for letters in INERTIAL}

    @cached_property
    def _links(self) -> TreeLinks:
        asked = [name for name, own in self._names.items() if self.only is None or own in self.only]
        return TreeLinks(self.tree, frozenset(asked))
