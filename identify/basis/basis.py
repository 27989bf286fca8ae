"""A robot as identification sees it: a sum of column blocks."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self, final

import numpy as np

from identify.arrays import HELD, Array, Columns
from identify.basis.block import AbstractBlock, Narrowing
from identify.basis.parameter import RIGID, Parameter
from identify.blame import expect
from identify.errors import PluginError, SettingError
from identify.signals.state import State


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
    kept : mapping of str to str, optional
        Parameters of the blocks that stay, and what they are called here; all, by their own names, by default.
    slides : tuple of int
        Joints that slide, from 0: their frictions and rotors have units of translation.
    held : mapping of str to Array or float
        Parameters of the blocks that are known, shape (...): their torques are no part of W X, but stand in `HELD`.

    Raises
    ------
    SettingError
        If a parameter appears twice, or `order` or `kept` name one that no block has.
    """

    n: int
    blocks: tuple[AbstractBlock, ...]
    order: tuple[str, ...] = ()
    kept: Mapping[str, str] | None = None
    slides: tuple[int, ...] = ()
    held: Mapping[str, Array | float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        names = list(self._own)
        every = [parameter.name for block in self.blocks for parameter in block.parameters(self.n)]
        if twice := sorted({name for name in every if every.count(name) > 1}):
            raise SettingError(f"parameters {', '.join(twice)} come from two blocks: leave one of them out")
        if unknown := [name for name in (*self.order, *(self.kept or ())) if name not in names]:
            raise SettingError(f"there is no parameter {', '.join(unknown)} in this basis; there are {', '.join(names)}")

    def __add__(self, block: AbstractBlock) -> Self:
        kept = None if self.kept is None else {**self.kept, **{p.name: p.name for p in block.parameters(self.n)}}
        return replace(self, blocks=(*self.blocks, block), kept=kept)

    def holding(self, **values: Array | float) -> Self:
        """Return the basis with parameters that are known to have these values, and are not identified."""
        own = {new: old for old, new in self._renamed.items()}
        held = {own[name]: value for name, value in values.items()}
        return replace(self, held={**self.held, **held}).without(*values)

    @property
    def believed(self) -> dict[str, Array | float]:
        """Where parameters are believed to be that enter nonlinearly, shape (...); their columns are slopes there."""
        found = {name: value for block in self.blocks for name, value in block.believed(self.n).items()}
        return {self._renamed[name]: value for name, value in found.items() if name in self._renamed}

    @property
    def kept_names(self) -> Mapping[str, str]:
        """Parameters of the blocks that stay, and what they are called here."""
        return self._renamed

    @property
    def adaptive(self) -> bool:
        """Whether some columns depend on parameters, so that the basis holds about an estimate alone."""
        return any(block.adaptive for block in self.blocks)

    def adapted(self, X: Array) -> Self:
        """Return the basis, linear about an estimate X, shape (..., p)."""
        return replace(self, blocks=tuple(block.adapted(self, X) for block in self.blocks))

    def value(self, name: str, X: Array) -> Array | None:
        """Return the estimate, in X, of the parameter that a block calls `name`, shape (...); None if it is not identified."""
        new = self._renamed.get(name)
        return None if new is None else X[..., self.names.index(new)]

    def rigid(self) -> Self:
        """Return the basis of the rigid bodies and rotors alone."""
        own = [name for name in self._renamed if self._own[name].kind in RIGID]
        held = {name: value for name, value in self.held.items() if self._own[name].kind in RIGID}
        blocks = [b for b in self.blocks if {p.name for p in b.parameters(self.n)} & {*own, *held}]
        return replace(self, blocks=tuple(blocks), order=(), kept={name: self._renamed[name] for name in own}, held=held)

    def renamed(self, kept: Mapping[str, str]) -> Self:
        """Return the basis with these parameters alone, by new names; blocks are spared the work for others.

        Parameters
        ----------
        kept : mapping of str to str
            Parameters of this basis, and what they are called from now on.

        Raises
        ------
        SettingError
            If it names a parameter that there is not.
        """
        if unknown := [name for name in kept if name not in self.names]:
            raise SettingError(f"there is no parameter {', '.join(unknown)}; there are {', '.join(self.names)}")
        own = {new: old for old, new in self._renamed.items()}
        names = frozenset([*(own[name] for name in kept), *self.held])
        blocks = tuple(block.narrowed(names) if isinstance(block, Narrowing) else block for block in self.blocks)
        return replace(self, blocks=blocks, order=(), kept={own[name]: new for name, new in kept.items()})

    def without(self, *names: str) -> Self:
        """Return the basis without some of its parameters, which then count as zero."""
        self.renamed({name: name for name in names})  # complains of those that there are not
        if not set(self.names) - set(names):
            raise SettingError(f"without {', '.join(names)} there is no parameter left")
        return self.renamed({name: name for name in self.names if name not in names})

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """The p parameters, in the order of X."""
        return tuple(replace(self._own[name], name=new) for name, new in self._renamed.items())

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the p parameters, in the order of X."""
        return tuple(self._renamed.values())

    @property
    def units(self) -> tuple[str, ...]:
        """Units of the p parameters."""
        return tuple(parameter.unit for parameter in self.parameters)

    @cached_property
    def _own(self) -> dict[str, Parameter]:
        """The parameters of the blocks, by their names there."""
        every = [parameter for block in self.blocks for parameter in block.parameters(self.n)]
        return {p.name: p.of_a_slide() if p.joint in self.slides else p for p in every}

    @cached_property
    def _renamed(self) -> dict[str, str]:
        """What each parameter of the blocks is called here, in the order of X."""
        kept = {name: name for name in dict.fromkeys((*self.order, *self._own))} if self.kept is None else self.kept
        return {name: kept[name] for name in dict.fromkeys((*self.order, *kept)) if name in kept}

    def explicit(self, state: State) -> Columns:
        """Return the columns of the joint torques (Eq. 5, 6)."""
        return self._sum(state, "explicit")

    def momentum(self, state: State) -> Columns:
        """Return the columns of the momenta (Eq. 9)."""
        return self._sum(state, "momentum")

    def remainder(self, state: State) -> Columns:
        """Return the columns of the torques that are no derivative of a momentum (Eq. 8, 9)."""
        return self._sum(state, "remainder")

    def energy(self, state: State) -> Columns:
        """Return the columns of the energy, in row 0 (Eq. 10)."""
        return self._sum(state, "energy")

    def dissipation(self, state: State) -> Columns:
        """Return the columns of the dissipated power, in row 0 (Eq. 10)."""
        return self._sum(state, "dissipation")

    def _sum(self, state: State, function: str) -> Columns:
        """Return what a column function of every block gives, together."""
        names, shape, total = self._renamed, (*state.q.shape[:-2], state.q.shape[-1]), dict[tuple[int, str], Array]()
        for block in self.blocks:
            held = self._held_of(block)
            found = getattr(block, function)(state)
            if not isinstance(found, Mapping):
                raise PluginError(
                    f"plug-in {type(block).__name__}.{function} returned {found!r:.60}, expected a mapping of columns"
                )
            for (row, name), signal in found.items():
                if name in names:
                    if np.shape(signal) != shape:
                        expect(block, f"{function} for {name}", signal, shape)
                    total[row, names[name]] = signal
                if name in held:
                    total[row, HELD] = total.get((row, HELD), 0.0) + np.asarray(held[name])[..., None] * signal
        return total

    def _held_of(self, block: AbstractBlock) -> dict[str, Array | float]:
        """Return what the columns of a block that are no part of W X are multiplied by.

        With a slope F g'(b) as the column of b, F g(b) + F g'(b) (b - b0) has - F g'(b) b0 that depends on no parameter.
        """
        own = {p.name for p in block.parameters(self.n)} if self.held else set()
        believed = block.believed(self.n)
        found = {name: value for name, value in self.held.items() if name in own}
        return found | {name: -np.asarray(value) for name, value in believed.items() if name in self._renamed}
