"""Coulomb friction."""

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np

from identify.arrays import Array
from identify.basis.base import AbstractFriction


@final
@dataclass(frozen=True)
class CoulombFriction(AbstractFriction):
    """Coulomb friction, Fs sign(qd)."""

    symbol: ClassVar[str] = "Fs"
    unit: ClassVar[str] = "N m"

    def force(self, q: Array, qd: Array) -> Array:
        """Return sign(qd)."""
        del q
        return np.sign(qd)
