"""Constant offset of a torque."""

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.basis.joint_law import AbstractFriction
from idbench.identify.basis.parameter import Kind


@final
@dataclass(frozen=True)
class Offset(AbstractFriction):
    """Constant torque, off: an amplifier's offset, or Coulomb friction that differs with the direction."""

    symbol: ClassVar[str] = "off"
    unit: ClassVar[str] = "N m"
    kind: ClassVar[Kind] = "offset"

    def force(self, q: Array, qd: Array) -> Array:
        """Return ones."""
        del q
        return np.ones_like(qd)
