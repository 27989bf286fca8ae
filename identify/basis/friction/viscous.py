"""Viscous friction."""

from dataclasses import dataclass
from typing import ClassVar, final

from idbench.identify.arrays import Array
from idbench.identify.basis.joint_law import AbstractFriction
from idbench.identify.basis.parameter import Kind


@final
@dataclass(frozen=True)
class ViscousFriction(AbstractFriction):
    """Viscous friction, Fv qd."""

    symbol: ClassVar[str] = "Fv"
    unit: ClassVar[str] = "N m s/rad"
    kind: ClassVar[Kind] = "viscous friction"

    def force(self, q: Array, qd: Array) -> Array:
        """Return qd."""
        del q
        return qd
