"""What a parameter of a robot is."""

from dataclasses import dataclass, replace
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

NOT_NEGATIVE: frozenset[Kind] = frozenset({"rotor inertia", "viscous friction", "Coulomb friction"})
"""Kinds whose values cannot be below zero."""

OF_A_SLIDE = {"N m": "N", "N m s/rad": "N s/m", "kg m^2": "kg"}
"""Units of rotor inertia and friction of a hinge -> those of a slide."""


@final
@dataclass(frozen=True)
class Parameter:
    """A parameter of a robot's model, such as the viscous friction of joint 2.

    Parameters
    ----------
    name : str
        Its name in tables, such as Fv2.
    joint : int, optional
        Its joint, or the joint that moves its link, from 0; None if it belongs to no joint.
    kind : str
        What it measures.
    unit : str
        Its SI unit.
    """

    name: str
    joint: int | None
    kind: Kind
    unit: str

    @property
    def symbol(self) -> str:
        """The name without the number of the joint, from 1, at its end: Fv of Fv2."""
        return self.name if self.joint is None else self.name.removesuffix(str(self.joint + 1))

    def regrouped(self) -> Self:
        """Return this parameter after others were grouped with it: ZZ1 becomes ZZR1."""
        number = self.name[len(self.symbol) :]
        return replace(self, name=f"{self.symbol}R{number}")

    def of_a_slide(self) -> Self:
        """Return this parameter with the unit that it has where the joint slides."""
        return self if self.kind in BODY else replace(self, unit=OF_A_SLIDE.get(self.unit, self.unit))
