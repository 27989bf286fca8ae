"""Friction that grows with a power of the velocity."""

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.basis.friction.shape import Shape, ShapedFriction
from idbench.identify.basis.joint_law import AbstractFriction


@final
@dataclass(frozen=True)
class PowerFriction(AbstractFriction):
    """Fp |qd|^exponent sign(qd): below 1, as of greased gears, it flattens at speed; in the place of viscous friction."""

    symbol: ClassVar[str] = "Fp"
    unit: ClassVar[str] = "N m"

    exponent: Array | float = 0.5
    """1 is viscous friction, 0 Coulomb's."""

    def force(self, q: Array, qd: Array) -> Array:
        """Return |qd|^exponent sign(qd)."""
        del q
        return np.abs(qd) ** self.exponent * np.sign(qd)


def power() -> ShapedFriction:
    """Friction of an unknown power of the velocity, Fp |qd|^ap sign(qd)."""
    return ShapedFriction(PowerFriction(), (Shape("exponent", "ap", "1", 0.5, (0.1, 2.0)),))
