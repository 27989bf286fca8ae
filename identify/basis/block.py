"""Column blocks: what a robot's basis is a sum of."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Set
from dataclasses import dataclass, field, replace
from typing import Any, Literal, Self, TypeAlias, final

from idbench.identify.arrays import Array
from idbench.identify.signals.signals import State

Kind = Literal[
    "inertia",
    "first moment",
    "mass",
    "rotor inertia",
    "viscous friction",
    "Coulomb friction",
    "friction",
    "shape of friction",
    "smooth friction",
    "offset",
    "stiffness",
    "other",
]

BODY: frozenset[Kind] = frozenset({"inertia", "first moment", "mass"})  # Kinds of parameters of a rigid body
RIGID: frozenset[Kind] = BODY | {"rotor inertia"}  # Kinds of parameters of what has inertia

FRICTION: frozenset[Kind] = frozenset(
    {"viscous friction", "Coulomb friction", "friction", "shape of friction", "smooth friction"}
)
"""Kinds of parameters of what resists motion: their torques turn with the velocity, which those of bodies do not."""

NOT_NEGATIVE: frozenset[Kind] = frozenset({"rotor inertia", "viscous friction", "Coulomb friction"})
"""Kinds whose values cannot be below zero."""

OF_A_SLIDE = {"N m": "N", "N m s/rad": "N s/m", "kg m^2": "kg"}
"""Units of rotor inertia and friction of a hinge -> those of a slide."""


def named(letters: str, joint: int) -> str:
    """Return the name of a joint's parameter: its letters, and the number of the joint, from 1."""
    return f"{letters}{joint + 1}"


@dataclass(frozen=True)
class Parameter:
    """A parameter of a robot's model, such as the viscous friction of joint 2.

    Two are the same if letters, joint and drive are: a name is only how one is written.
    """

    symbol: str
    """Letters of what it is, such as Fv."""
    joint: int | None
    """Its joint, or the joint that moves its link, from 0; None if it belongs to no joint."""
    kind: Kind = field(compare=False)
    """What it measures."""
    unit: str = field(compare=False)
    """Its SI unit."""
    drive: str = ""
    """Name of the drive that it belongs to, if that turns with several joints."""
    grouped: bool = field(default=False, compare=False)
    """Whether others are grouped with it: ZZ of joint 1 is written ZZR1 then."""
    scale: float = field(default=1.0, compare=False)
    """What it is over what its block has: the paper's LMX2 is L times the first moment."""
    label: str = field(default="", compare=False)
    """Letters that are written instead of its symbol."""

    @property
    def name(self) -> str:
        """What it is called in tables, such as Fv2."""
        letters = (self.label or self.symbol) + "R" * self.grouped
        return f"{letters}_{self.drive}" if self.drive else letters if self.joint is None else named(letters, self.joint)

    @property
    def is_random_effect(self) -> bool:
        """Whether it is no physical parameter, but a height of a smooth function whose size the log decides."""
        return self.kind == "smooth friction"

    def of_a_slide(self) -> Self:
        """Return this parameter with the unit that it has where the joint slides."""
        return self if self.kind in BODY else replace(self, unit=OF_A_SLIDE.get(self.unit, self.unit))


BlockColumns: TypeAlias = Mapping[tuple[int, Parameter], Array]
"""Columns of a block that are not identically zero: (row of an instant, parameter) -> signal (..., time)."""


class AbstractBlock(ABC):
    """Named columns of a robot, linear in its parameters, as the three models need them.

    Every function takes a state, signals of shape (..., joint, time), and returns the columns that are not identically
    zero, (row of an instant, parameter) -> (..., time). A state may be a stretch of a motion. For all states, with s = d/dt,

        explicit = s momentum + remainder          qd' explicit = s energy + dissipation

    which is what makes the three models equivalent.
    """

    @abstractmethod
    def parameters(self, n: int) -> tuple[Parameter, ...]:
        """Return the parameters of this block for a robot of `n` joints."""

    @abstractmethod
    def explicit(self, state: State) -> BlockColumns:
        """Return the columns D(q, qd, qdd) of the joint torques (Eq. 5, 6)."""

    def momentum(self, state: State) -> BlockColumns:
        """Return the columns M_i(q) qd of the momenta, still to be differentiated (Eq. 9); none by default."""
        return {}

    def remainder(self, state: State) -> BlockColumns:
        """Return the columns R_i(q, qd) of the torques that are no derivative of a momentum (Eq. 8, 9); none by default."""
        return {}

    def energy(self, state: State) -> BlockColumns:
        """Return the columns h_i(q, qd) of the energy in row 0, still to be differentiated (Eq. 10); none by default."""
        return {}

    def dissipation(self, state: State) -> BlockColumns:
        """Return the columns of the dissipated power qd' Gamma_f in row 0 (Eq. 10); none by default."""
        return {}

    def narrowed(self, parameters: Set[Parameter]) -> "AbstractBlock":
        """Return the block without the work for other parameters, whose columns nobody asks for; itself by default."""
        return self

    @property
    def is_nonlinear(self) -> bool:
        """Whether columns depend on parameters, so that the block holds about an estimate alone: see `adapted`."""
        return False

    def adapted(self, basis: Any, X: Array) -> "AbstractBlock":
        """Return the block about an estimate X, shape (..., p), in a `Basis` that has it: ``basis.value(parameter, X)``."""
        return self

    def operating_point(self, n: int) -> Mapping[Parameter, Array | float]:
        """Return the operating point of nonlinear parameters, shape (...): their columns are derivatives there."""
        return {}


class AbstractWithoutMomentum(AbstractBlock):
    """A block without momenta, such as friction or a spring: its torques are those of the remainder."""

    @final
    def explicit(self, state: State) -> BlockColumns:
        """Return the remainder."""
        return self.remainder(state)


class AbstractColumns(AbstractBlock):
    """A block that finds its columns in the same way whichever function asks for them."""

    @abstractmethod
    def columns(self, function: str, state: State) -> BlockColumns:
        """Return the columns of a function of this name: explicit, momentum, remainder, energy or dissipation."""

    @final
    def explicit(self, state: State) -> BlockColumns:
        """Return D (Eq. 5, 6)."""
        return self.columns("explicit", state)

    @final
    def momentum(self, state: State) -> BlockColumns:
        """Return M_i(q) qd (Eq. 9)."""
        return self.columns("momentum", state)

    @final
    def remainder(self, state: State) -> BlockColumns:
        """Return R_i(q, qd) (Eq. 8, 9)."""
        return self.columns("remainder", state)

    @final
    def energy(self, state: State) -> BlockColumns:
        """Return h_i(q, qd) (Eq. 10)."""
        return self.columns("energy", state)

    def dissipation(self, state: State) -> BlockColumns:
        """Return qd' Gamma_f (Eq. 10)."""
        return self.columns("dissipation", state)


class AbstractConservativeBlock(AbstractBlock):
    """A block that stores energy and dissipates none: rigid bodies, rotors, springs."""

    @final
    def dissipation(self, state: State) -> BlockColumns:
        """Return no columns."""
        return {}
