"""Viscous friction that differs with the direction."""

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.basis.joint_law import AbstractFriction


@final
@dataclass(frozen=True)
class AsymmetricViscousFriction(AbstractFriction):
    """Asymmetric viscous friction, Fva |qd|: Fv + Fva forwards and Fv - Fva backwards; with `offset`, the asymmetric law."""

    symbol: ClassVar[str] = "Fva"
    unit: ClassVar[str] = "N m s/rad"

    def force(self, q: Array, qd: Array) -> Array:
        """Return |qd|."""
        del q
        return np.abs(qd)
