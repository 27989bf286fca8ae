"""What a parameter of a robot is."""

from dataclasses import dataclass, field, replace
from typing import Literal, Self, final

Kind = Literal[
    "inertia",
    "first moment",
    "mass",
    "rotor inertia",
    "viscous friction",
    "Coulomb friction",
    "friction",
    "shape of friction",
    "offset",
    "stiffness",
    "other",
]

BODY: frozenset[Kind] = frozenset({"inertia", "first moment", "mass"})
"""Kinds of parameters of a rigid body."""

RIGID: frozenset[Kind] = BODY | {"rotor inertia"}
"""Kinds of parameters of what has inertia."""

FRICTION: frozenset[Kind] = frozenset({"viscous friction", "Coulomb friction", "friction", "shape of friction"})
"""Kinds of parameters of what resists motion: their torques turn with the velocity, which those of bodies do not."""

NOT_NEGATIVE: frozenset[Kind] = frozenset({"rotor inertia", "viscous friction", "Coulomb friction"})
"""Kinds whose values cannot be below zero."""

OF_A_SLIDE = {"N m": "N", "N m s/rad": "N s/m", "kg m^2": "kg"}
"""Units of rotor inertia and friction of a hinge -> those of a slide."""


def named(letters: str, joint: int) -> str:
    """Return the name of a joint's parameter: its letters, and the number of the joint, from 1."""
    return f"{letters}{joint + 1}"


@final
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

    def of_a_slide(self) -> Self:
        """Return this parameter with the unit that it has where the joint slides."""
        return self if self.kind in BODY else replace(self, unit=OF_A_SLIDE.get(self.unit, self.unit))
