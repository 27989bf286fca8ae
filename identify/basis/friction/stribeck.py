"""Stribeck friction."""

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.basis.friction.shape import Shape, ShapedFriction
from idbench.identify.basis.joint_law import AbstractFriction


@final
@dataclass(frozen=True)
class StribeckFriction(AbstractFriction):
    """What friction near standstill has above that of sliding, Fst exp(-(|qd|/vs)^exponent) sign(qd).

    B. Armstrong-Helouvry, P. Dupont and C. Canudas de Wit, Automatica 30 (1994) 1083-1138.
    """

    symbol: ClassVar[str] = "Fst"
    unit: ClassVar[str] = "N m"

    vs: Array | float = 0.1
    """Stribeck velocity [rad/s]."""
    exponent: Array | float = 2.0
    """2 is Gaussian, 1 Tustin's."""

    def force(self, q: Array, qd: Array) -> Array:
        """Return exp(-(|qd|/vs)^exponent) sign(qd)."""
        del q
        return np.exp(-((np.abs(qd) / self.vs) ** self.exponent)) * np.sign(qd)


SPEED = Shape("vs", "vs", "rad/s", 0.1, (0.02, 1.0))
EXPONENT = Shape("exponent", "ds", "1", 1.0, (0.5, 3.0))


def stribeck() -> ShapedFriction:
    """Stribeck friction of unknown Stribeck velocity vs, Fst exp(-(qd/vs)^2) sign(qd)."""
    return ShapedFriction(StribeckFriction(), (SPEED,))


def free_stribeck() -> ShapedFriction:
    """Stribeck friction of unknown velocity and exponent, Fst exp(-(|qd|/vs)^ds) sign(qd)."""
    return ShapedFriction(StribeckFriction(), (SPEED, EXPONENT))
