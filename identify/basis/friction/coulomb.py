"""Coulomb friction."""

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.basis.joint_law import AbstractFriction
from idbench.identify.basis.parameter import Kind


@final
@dataclass(frozen=True)
class CoulombFriction(AbstractFriction):
    """Coulomb friction, Fs sign(qd)."""

    symbol: ClassVar[str] = "Fs"
    unit: ClassVar[str] = "N m"
    kind: ClassVar[Kind] = "Coulomb friction"

    def force(self, q: Array, qd: Array) -> Array:
        """Return sign(qd)."""
        del q
        return np.sign(qd)
