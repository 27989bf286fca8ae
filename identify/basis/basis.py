"""A robot as identification sees it: a sum of column blocks."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self, final

from identify.arrays import Columns
from identify.basis.base import AbstractBlock
from identify.errors import SettingError
from identify.state import State


@final
@dataclass(frozen=True)
class Basis:
    """A sum of column blocks for a robot of n joints; ``basis + block`` adds one.

    Parameters
    ----------
    n : int
        Number of joints.
    blocks : tuple of AbstractBlock
        The blocks; no two may have a parameter in common.
    order : tuple of str
        Parameters to be put first, in this order; those of the blocks that it leaves out follow as they come.

    Raises
    ------
    SettingError
        If a parameter appears twice, or `order` names one that no block has.
    """

    n: int
    blocks: tuple[AbstractBlock, ...]
    order: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        names = [name for block in self.blocks for name in block.names(self.n)]
        if twice := sorted({name for name in names if names.count(name) > 1}):
            raise SettingError(f"parameters {', '.join(twice)} come from two blocks: leave one of them out")
        if unknown := [name for name in self.order if name not in names]:
            raise SettingError(f"the order names {', '.join(unknown)}, which no block has; there are {', '.join(names)}")

    def __add__(self, block: AbstractBlock) -> Self:
        return replace(self, blocks=(*self.blocks, block))

    @cached_property
    def _units(self) -> dict[str, str]:
        units = {n: u for block in self.blocks for n, u in zip(block.names(self.n), block.units(self.n), strict=True)}
        return {name: units[name] for name in dict.fromkeys((*self.order, *units))}

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the p parameters, in the order of X."""
        return tuple(self._units)

    @property
    def units(self) -> tuple[str, ...]:
        """Units of the p parameters."""
        return tuple(self._units.values())

    def explicit(self, state: State) -> Columns:
        """Return the columns of the joint torques (Eq. 5, 6)."""
        return self._sum(lambda block: block.explicit(state))

    def momentum(self, state: State) -> Columns:
        """Return the columns of the momenta (Eq. 9)."""
        return self._sum(lambda block: block.momentum(state))

    def remainder(self, state: State) -> Columns:
        """Return the columns of the torques that are no derivative of a momentum (Eq. 8, 9)."""
        return self._sum(lambda block: block.remainder(state))

    def energy(self, state: State) -> Columns:
        """Return the columns of the energy, in row 0 (Eq. 10)."""
        return self._sum(lambda block: block.energy(state))

    def dissipation(self, state: State) -> Columns:
        """Return the columns of the dissipated power, in row 0 (Eq. 10)."""
        return self._sum(lambda block: block.dissipation(state))

    def _sum(self, columns: Callable[[AbstractBlock], Columns]) -> Columns:
        return {address: signal for block in self.blocks for address, signal in columns(block).items()}
