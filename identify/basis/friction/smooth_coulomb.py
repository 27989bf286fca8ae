"""Coulomb friction that does not jump."""

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.basis.friction.shape import Shape, ShapedFriction
from idbench.identify.basis.joint_law import AbstractFriction

START, RANGE = 0.2, (0.01, 5.0)


@final
@dataclass(frozen=True)
class TanhFriction(AbstractFriction):
    """Ft tanh(qd/vt): Coulomb friction without its jump, in the place of it."""

    symbol: ClassVar[str] = "Ft"
    unit: ClassVar[str] = "N m"
    replaces: ClassVar[str] = "Fs"

    vt: Array | float = 0.1
    """Velocity over which it rises [rad/s]."""

    def force(self, q: Array, qd: Array) -> Array:
        """Return tanh(qd/vt)."""
        del q
        return np.tanh(qd / self.vt)


@final
@dataclass(frozen=True)
class ArctanFriction(AbstractFriction):
    """Fat 2/pi arctan(qd/vat): Coulomb friction without its jump, in the place of it; it rises longer than tanh."""

    symbol: ClassVar[str] = "Fat"
    unit: ClassVar[str] = "N m"
    replaces: ClassVar[str] = "Fs"

    vat: Array | float = 0.1
    """Velocity at which it has risen by half [rad/s]."""

    def force(self, q: Array, qd: Array) -> Array:
        """Return 2/pi arctan(qd/vat)."""
        del q
        return 2 / np.pi * np.arctan(qd / self.vat)


def tanh() -> ShapedFriction:
    """Coulomb friction that rises over an unknown velocity, Ft tanh(qd/vt); in the place of `coulomb`."""
    return ShapedFriction(TanhFriction(), (Shape("vt", "vt", "rad/s", START, RANGE),))


def arctan() -> ShapedFriction:
    """Coulomb friction that rises over an unknown velocity, Fat 2/pi arctan(qd/vat); in the place of `coulomb`."""
    return ShapedFriction(ArctanFriction(), (Shape("vat", "vat", "rad/s", START, RANGE),))
