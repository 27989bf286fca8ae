"""Viscous friction."""

from dataclasses import dataclass
from typing import ClassVar, final

from identify.arrays import Array
from identify.basis.base import AbstractFriction


@final
@dataclass(frozen=True)
class ViscousFriction(AbstractFriction):
    """Viscous friction, Fv qd."""

    symbol: ClassVar[str] = "Fv"
    unit: ClassVar[str] = "N m s/rad"

    def force(self, q: Array, qd: Array) -> Array:
        """Return qd."""
        del q
        return qd
