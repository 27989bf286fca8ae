"""Friction laws with parameters that enter nonlinearly."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.basis.basis import Basis
from idbench.identify.basis.block import Kind, Parameter
from idbench.identify.basis.joint_law import AbstractFriction, AbstractJointLaw
from idbench.identify.signals.signals import State

STEP = 1e-4  # Of central differences by the logarithm of a shape
FACTOR = 2.0  # By which a shape changes at most from one round to the next: the slope there says little of what is farther away


class Shape(NamedTuple):
    """A parameter of a law that enters nonlinearly; it is above zero."""

    setting: str
    """The law's own setting."""
    letters: str
    """What it is called; the joint's number, from 1, follows."""
    unit: str
    """Its unit."""
    start: float
    """Its operating point while nothing is known."""
    range: tuple[float, float]
    """Within which it is looked for."""

    def grid(self, count: int) -> tuple[float, ...]:
        """Return values over the range, in even ratios; of several shapes of one law fewer will do."""
        return tuple(float(x) for x in np.geomspace(*self.range, count))


@dataclass(frozen=True)
class ShapedFriction(AbstractJointLaw):
    """A friction law F g(qd; b) with unknown shapes b, linearized at their operating point.

    With the size F0 and the shapes b0 of an estimate, the columns are g(qd; b0) of F and F0 dg/db of b: at the optimum, where
    F0 and b0 are the estimate itself, these are the slopes of the residual, and sigma is that of nonlinear least squares.
    """

    is_nonlinear: ClassVar[bool] = True

    law: AbstractFriction
    """The law; its settings of the shapes take arrays."""
    shapes: tuple[Shape, ...]
    """What of it is unknown."""
    size: Array | float = 1.0
    """F0, shape (..., joint)."""
    values: Mapping[str, Array | float] = field(default_factory=dict)
    """b0 by the law's settings, shape (..., joint)."""

    def letters(self) -> Mapping[str, tuple[Kind, str]]:
        """Return those of the law's size and of the shapes."""
        return {**self.law.letters(), **{shape.letters: ("shape of friction", shape.unit) for shape in self.shapes}}

    def torques(self, state: State) -> Mapping[str, Array]:
        """Return g, and F0 dg/db of every shape."""
        n, force = state.n, partial(self._force, state)
        size = np.broadcast_to(np.asarray(self.size), (*np.shape(self.size)[:-1], n))[..., None]
        found = {self.law.symbol: force(self.at_joints(n))}
        for shape in self.shapes:
            b = self.at_joints(n)
            ahead, behind = ({**b, shape.setting: b[shape.setting] * np.exp(h)} for h in (STEP, -STEP))
            found[shape.letters] = size * ((force(ahead) - force(behind)) / (2 * STEP * b[shape.setting][..., None]))
        return found

    def operating_point(self, n: int) -> Mapping[Parameter, Array | float]:
        """Return b0."""
        at, found = self.at_joints(n), {s.letters: s.setting for s in self.shapes}
        return {p: at[found[p.symbol]][..., p.joint] for p in self.parameters(n) if p.symbol in found}

    def adapted(self, basis: Basis, X: Array) -> Self:
        """Return the law, linear about an estimate."""
        at, known = self.at_joints(basis.n), {p: basis.value(p, X) for p in self.parameters(basis.n)}
        size = _joints(basis.n, X, self.law.symbol, known, self.size)
        values = {}
        for shape in self.shapes:
            old = at[shape.setting]
            new = _joints(basis.n, X, shape.letters, known, old)
            low, high = np.maximum(old / FACTOR, shape.range[0]), np.minimum(old * FACTOR, shape.range[1])
            values[shape.setting] = np.clip(new, low, high)
        return replace(self, size=size, values=values)

    def at(self, values: Mapping[str, Array | float]) -> Self:
        """Return the law with other b0, by the law's settings, shape (..., joint)."""
        return replace(self, values={**self.values, **values})

    def at_joints(self, n: int) -> dict[str, Array]:
        """Return b0, shape (..., joint)."""
        middle = {shape.setting: shape.start for shape in self.shapes}
        found = {name: np.asarray(value, dtype=np.float64) for name, value in {**middle, **self.values}.items()}
        return {name: np.broadcast_to(x, (*x.shape[:-1], n)) for name, x in found.items()}

    def _force(self, state: State, b: Mapping[str, Array]) -> Array:
        return with_settings(self.law, {name: x[..., None] for name, x in b.items()}).force(state.q, state.qd)


def with_settings(law: AbstractFriction, settings: Mapping[str, Any]) -> AbstractFriction:
    """Return a law with other settings."""
    made: Any = law
    return replace(made, **settings)


def _joints(n: int, X: Array, letters: str, known: Mapping[Parameter, Array | None], default: Array | float) -> Array:
    """Return a value of every joint, shape (..., joint), that of `default` where there is none or it is not finite."""
    found = np.array(np.broadcast_to(default, (*X.shape[:-1], n)), dtype=np.float64)
    for parameter, x in known.items():
        if parameter.symbol == letters and x is not None:
            found[..., parameter.joint] = np.where(np.isfinite(x), x, found[..., parameter.joint])
    return found


@dataclass(frozen=True)
class PowerFriction(AbstractFriction):
    """Fp |qd|^exponent sign(qd): below 1, as of greased gears, it flattens at speed; in the place of viscous friction."""

    symbol: ClassVar[str] = "Fp"
    unit: ClassVar[str] = "N m"

    exponent: Array | float = 0.5
    """1 is viscous friction, 0 Coulomb's."""

    def force(self, q: Array, qd: Array) -> Array:
        """Return |qd|^exponent sign(qd)."""
        return np.abs(qd) ** self.exponent * np.sign(qd)


def power() -> ShapedFriction:
    """Friction of an unknown power of the velocity, Fp |qd|^ap sign(qd)."""
    return ShapedFriction(PowerFriction(), (Shape("exponent", "ap", "1", 0.5, (0.1, 2.0)),))


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
        return np.exp(-((np.abs(qd) / self.vs) ** self.exponent)) * np.sign(qd)


# Stribeck velocities of published joints are 0.02 to 0.5 rad/s, exponents 0.5 to 2 (Armstrong-Helouvry et al., 1994).
SPEED = Shape("vs", "vs", "rad/s", 0.1, (0.02, 1.0))
EXPONENT = Shape("exponent", "ds", "1", 1.0, (0.5, 3.0))  # 1 is Tustin's, 2 Gaussian


def stribeck() -> ShapedFriction:
    """Stribeck friction of unknown Stribeck velocity vs, Fst exp(-(qd/vs)^2) sign(qd)."""
    return ShapedFriction(StribeckFriction(), (SPEED,))


def free_stribeck() -> ShapedFriction:
    """Stribeck friction of unknown velocity and exponent, Fst exp(-(|qd|/vs)^ds) sign(qd)."""
    return ShapedFriction(StribeckFriction(), (SPEED, EXPONENT))
