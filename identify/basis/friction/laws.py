"""Laws of friction that are linear in their parameters, and what else a torque has: an offset, cogging."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.basis.block import Kind
from idbench.identify.basis.friction.shape import Shape, ShapedFriction
from idbench.identify.basis.joint_law import AbstractFriction, AbstractJointLaw
from idbench.identify.errors import require_positive
from idbench.identify.signals.signals import State


@dataclass(frozen=True)
class ViscousFriction(AbstractFriction):
    """Viscous friction, Fv qd."""

    symbol: ClassVar[str] = "Fv"
    unit: ClassVar[str] = "N m s/rad"
    kind: ClassVar[Kind] = "viscous friction"

    def force(self, q: Array, qd: Array) -> Array:
        """Return qd."""
        return qd


@dataclass(frozen=True)
class AsymmetricViscousFriction(AbstractFriction):
    """Asymmetric viscous friction, Fva |qd|: Fv + Fva forwards and Fv - Fva backwards; with `offset`, the asymmetric law."""

    symbol: ClassVar[str] = "Fva"
    unit: ClassVar[str] = "N m s/rad"

    def force(self, q: Array, qd: Array) -> Array:
        """Return |qd|."""
        return np.abs(qd)


@dataclass(frozen=True)
class CoulombFriction(AbstractFriction):
    """Coulomb friction, Fs sign(qd)."""

    symbol: ClassVar[str] = "Fs"
    unit: ClassVar[str] = "N m"
    kind: ClassVar[Kind] = "Coulomb friction"

    def force(self, q: Array, qd: Array) -> Array:
        """Return sign(qd)."""
        return np.sign(qd)


START, RANGE = 0.2, (0.01, 5.0)  # Velocity over which friction rises: where it is looked for first, and within [rad/s]


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
        return np.tanh(qd / self.vt)


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
        return 2 / np.pi * np.arctan(qd / self.vat)


def tanh() -> ShapedFriction:
    """Coulomb friction that rises over an unknown velocity, Ft tanh(qd/vt); in the place of `coulomb`."""
    return ShapedFriction(TanhFriction(), (Shape("vt", "vt", "rad/s", START, RANGE),))


def arctan() -> ShapedFriction:
    """Coulomb friction that rises over an unknown velocity, Fat 2/pi arctan(qd/vat); in the place of `coulomb`."""
    return ShapedFriction(ArctanFriction(), (Shape("vat", "vat", "rad/s", START, RANGE),))


@dataclass(frozen=True)
class Cogging(AbstractJointLaw):
    """Cogging of a known period, such as of 12 waves: C12s sin(12 q) + C12c cos(12 q); a sum may have several."""

    asks: ClassVar[str] = "the number of periods in a turn of the joint, such as cogging:12"

    periods: float = 12.0
    """In a turn of the joint: slots and poles of the motor, times the ratio of its gear."""

    def __post_init__(self) -> None:
        require_positive(periods=self.periods)

    def letters(self) -> Mapping[str, tuple[Kind, str]]:
        """Return C12s and C12c."""
        return {f"C{self.periods:g}{part}": ("other", "N m") for part in "sc"}

    def torques(self, state: State) -> Mapping[str, Array]:
        """Return sine and cosine."""
        return dict(zip(self.letters(), (np.sin(self.periods * state.q), np.cos(self.periods * state.q)), strict=True))


@dataclass(frozen=True)
class TemperatureFriction(AbstractJointLaw):
    """Friction that changes with the logged temperature T, (FvT qd + FsT sign(qd)) (T - reference)."""

    reference: float = 25.0
    """Temperature at which Fv and Fs are what they are alone [deg C]."""

    def letters(self) -> Mapping[str, tuple[Kind, str]]:
        """Return FvT and FsT."""
        return {"FvT": ("friction", "N m s/rad/K"), "FsT": ("friction", "N m/K")}

    def torques(self, state: State) -> Mapping[str, Array]:
        """Return (T - reference) times qd, and times its sign."""
        above = state.condition("temperature") - self.reference
        return {"FvT": above * state.qd, "FsT": above * np.sign(state.qd)}


@dataclass(frozen=True)
class Offset(AbstractFriction):
    """Constant torque, off: an amplifier's offset, or Coulomb friction that differs with the direction."""

    symbol: ClassVar[str] = "off"
    unit: ClassVar[str] = "N m"
    kind: ClassVar[Kind] = "offset"

    def force(self, q: Array, qd: Array) -> Array:
        """Return ones."""
        return np.ones_like(qd)


CENTRES = tuple(float(x) for x in np.linspace(-4, 4, 17))
"""Centres of the bumps, in asinh(qd/v): with v a tenth of the rms speed they reach 2.7 times it, in either direction."""

WIDTH = 0.5  # Width of a bump, which is their distance


@dataclass(frozen=True)
class SmoothFriction(AbstractJointLaw):
    """Friction as a smooth function of velocity, sum over k of u_k exp(-(asinh(qd/v) - c_k)^2 / (2 w^2)), beside other laws.

    Its parameters are no physical ones: they are random effects, whose size the log decides.
    """

    asks: ClassVar[str] = "the velocity [rad/s] below which it is fine, a tenth of the joint's rms speed, such as smooth:0.1"

    v: float = 0.1
    """Velocity [rad/s] up to which bumps are equally wide; beyond it they grow with the velocity."""

    def __post_init__(self) -> None:
        require_positive(v=self.v)

    def letters(self) -> Mapping[str, tuple[Kind, str]]:
        """Return u_1_ to u_17_."""
        return {f"u{k + 1}_": ("smooth friction", "N m") for k in range(len(CENTRES))}

    def torques(self, state: State) -> Mapping[str, Array]:
        """Return the bumps."""
        x = np.arcsinh(state.qd / self.v)
        return {f"u{k + 1}_": np.exp(-((x - c) ** 2) / (2 * WIDTH**2)) for k, c in enumerate(CENTRES)}
