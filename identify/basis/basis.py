"""A robot as identification sees it: a sum of column blocks."""

from collections import Counter
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

import numpy as np

from idbench.identify.arrays import HELD, Array, Columns
from idbench.identify.basis.block import AbstractBlock, Kind, Parameter
from idbench.identify.blame import expect, expect_kind
from idbench.identify.errors import SettingError
from idbench.identify.signals.signals import State


@dataclass(frozen=True)
class Basis:
    """A sum of column blocks for a robot of n joints; ``basis + block`` adds one.

    Raises
    ------
    SettingError
        If a parameter appears twice, two have one name, or `kept` has one that no block has.
    """

    n: int
    """Number of joints."""
    blocks: tuple[AbstractBlock, ...]
    """The blocks; no two may have a parameter in common."""
    kept: tuple[Parameter, ...] | None = None
    """The p parameters, in the order of X; all of the blocks by default."""
    slides: tuple[int, ...] = ()
    """Joints that slide, from 0: their frictions and rotors have units of translation."""
    held: Mapping[Parameter, Array | float] = field(default_factory=dict)
    """Parameters that are known, shape (...): their torques are no part of W X, but stand in `HELD`."""
    tied: Mapping[Parameter, Parameter] = field(default_factory=dict)
    """Parameters that equal others, such as those of the same motor: their columns are added to those of the others."""

    def __post_init__(self) -> None:
        every = [parameter for block in self.blocks for parameter in block.parameters(self.n)]
        known = Counter(every)
        if twice := sorted(p.name for p, count in known.items() if count > 1):
            raise SettingError(f"parameters {', '.join(twice)} come from two blocks: leave one of them out")
        if unknown := [p.name for p in self.parameters if p not in known]:
            raise SettingError(
                f"no block has the parameters {', '.join(unknown)}; they have {', '.join(p.name for p in every)}"
            )
        if twice := sorted(name for name, count in Counter(self.names).items() if count > 1):
            raise SettingError(f"two parameters are called {', '.join(twice)}: give one of them other letters")

    @property
    def hinges(self) -> list[int]:
        """Joints that turn, from 0."""
        return [j for j in range(self.n) if j not in self.slides]

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """The p parameters, in the order of X."""
        every = [p for block in self.blocks for p in block.parameters(self.n)] if self.kept is None else self.kept
        return tuple(p.of_a_slide() if p.joint in self.slides else p for p in every)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the p parameters, in the order of X."""
        return tuple(parameter.name for parameter in self.parameters)

    @property
    def units(self) -> tuple[str, ...]:
        """Units of the p parameters."""
        return tuple(parameter.unit for parameter in self.parameters)

    @property
    def without_random_effects(self) -> list[int]:
        """Places in X of the parameters that are shown one by one: all but heights of smooth functions."""
        return [i for i, parameter in enumerate(self.parameters) if not parameter.is_random_effect]

    @cached_property
    def places(self) -> dict[Parameter, int]:
        """Where the parameters stand in X."""
        own = {parameter: k for k, parameter in enumerate(self.parameters)}
        return own | {parameter: own[other] for parameter, other in self.tied.items() if other in own}

    def __add__(self, block: AbstractBlock) -> Self:
        kept = None if self.kept is None else (*self.kept, *block.parameters(self.n))
        return replace(self, blocks=(*self.blocks, block), kept=kept)

    def of(self, parameters: Sequence[Parameter]) -> Self:
        """Return the basis with these parameters alone, in this order; blocks are spared the work for others."""
        asked = {*parameters, *self.held, *(p for p, other in self.tied.items() if other in parameters)}
        blocks = (block.narrowed(asked) for block in self.blocks)
        there = tuple(block for block in blocks if asked.intersection(block.parameters(self.n)))
        return replace(self, blocks=there, kept=tuple(parameters))

    def only(self, kinds: Container[Kind]) -> Self:
        """Return the basis with the parameters of some kinds alone, those that are held too."""
        held = {parameter: value for parameter, value in self.held.items() if parameter.kind in kinds}
        return replace(self, held=held).of([parameter for parameter in self.parameters if parameter.kind in kinds])

    def named(self, *names: str) -> list[Parameter]:
        """Return parameters by their names; raise SettingError if there is no such one."""
        if unknown := [name for name in names if name not in self.names]:
            raise SettingError(f"there is no parameter {', '.join(unknown)}; there are {', '.join(self.names)}")
        return [self.parameters[self.names.index(name)] for name in names]

    def without(self, *names: str) -> Self:
        """Return the basis without some of its parameters, which then count as zero."""
        out = self.named(*names)
        if not set(self.parameters) - set(out):
            raise SettingError(f"without {', '.join(names)} there is no parameter left")
        return self.of([parameter for parameter in self.parameters if parameter not in out])

    def holding(self, **values: Array | float) -> Self:
        """Return the basis with parameters that are known to have these values, and are not identified."""
        held = {p: value / p.scale for p, value in zip(self.named(*values), values.values(), strict=True)}
        return replace(self, held={**self.held, **held}).without(*values)

    def with_ties(self, **names: str) -> Self:
        """Return the basis with parameters, by name, that equal others.

        Raises
        ------
        SettingError
            If there is no such parameter, one is tied to itself or to one that is tied, or the units of two differ.
        """
        ties = dict(zip(self.named(*names), self.named(*names.values()), strict=True))
        for parameter, other in ties.items():
            if parameter.unit != other.unit or parameter.kind != other.kind:
                raise SettingError(f"{parameter.name} [{parameter.unit}] and {other.name} [{other.unit}] cannot be equal")
            if other in ties:
                raise SettingError(f"{parameter.name} is tied to {other.name}, which is tied itself: tie both to a third one")
        kept = [parameter for parameter in self.parameters if parameter not in ties]
        return replace(self, tied={**self.tied, **ties}).of(kept)

    def linearized_at(self, X: Array) -> Self:
        """Return the basis, linear about an estimate X, shape (..., p)."""
        return replace(self, blocks=tuple(block.adapted(self, X) for block in self.blocks))

    def exchanged(self, old: AbstractBlock, new: AbstractBlock) -> Self:
        """Return the basis with another block of the same parameters in the place of one."""
        return replace(self, blocks=tuple(new if block is old else block for block in self.blocks))

    @property
    def is_nonlinear(self) -> bool:
        """Whether some columns depend on parameters, so that the basis is linearized at an operating point."""
        return any(block.is_nonlinear for block in self.blocks)

    def split(self) -> tuple[Self, Self]:
        """Return the basis of the blocks that depend on no estimate, with all that is held, and that of the others."""
        nonlinear = {parameter for block in self.blocks if block.is_nonlinear for parameter in block.parameters(self.n)}
        fixed = [parameter for parameter in self.parameters if parameter not in nonlinear]
        return self.of(fixed), replace(self, held={}).of([parameter for parameter in self.parameters if parameter in nonlinear])

    @cached_property
    def operating_point(self) -> dict[int, Array | float]:
        """Operating point of the nonlinear parameters, shape (...), by their places: their columns are derivatives there."""
        found = {parameter: value for block in self.blocks for parameter, value in block.operating_point(self.n).items()}
        return {k: found[parameter] for parameter, k in self.places.items() if parameter in found}

    def value(self, parameter: Parameter, X: Array) -> Array | None:
        """Return the estimate, in X, of a parameter as its block has it, shape (...); None if it is not identified."""
        if (place := self.places.get(parameter)) is None:
            return None
        return X[..., place] / self.parameters[place].scale

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
        """Columns of every block by one column function, together."""
        shape, total = (*state.q.shape[:-2], state.q.shape[-1]), dict[tuple[int, int], Array]()
        for block in self.blocks:
            held, found = self.held_of(block), expect_kind(block, function, getattr(block, function)(state), Mapping)
            for (row, parameter), signal in found.items():
                if (place := self.places.get(parameter)) is not None:
                    if np.shape(signal) != shape:
                        expect(block, f"{function} for {parameter.name}", signal, shape)
                    scale = self.parameters[place].scale
                    column = signal if scale == 1 else signal / scale
                    total[row, place] = total[row, place] + column if (row, place) in total else column
                if parameter in held:
                    total[row, HELD] = total.get((row, HELD), 0.0) + np.asarray(held[parameter])[..., None] * signal
        return total

    def held_of(self, block: AbstractBlock) -> dict[Parameter, Array | float]:
        """Values by which the columns of a block that are no part of W X are multiplied.

        With a slope F g'(b) as the column of b, F g(b) + F g'(b) (b - b0) has - F g'(b) b0 that depends on no parameter.
        """
        own = block.parameters(self.n) if self.held else ()
        found = {parameter: self.held[parameter] for parameter in own if parameter in self.held}
        believed = block.operating_point(self.n).items()
        return found | {parameter: -np.asarray(value) for parameter, value in believed if parameter in self.places}
