"""What each inertial parameter of a link adds to a force and a moment at the origin of its frame."""

from typing import NamedTuple, Self

from idbench.identify.basis.parameter import Kind
from idbench.identify.basis.terms import ZERO, Matrix, Term, Vector, add, cross, dot, minus, plus, scaled, times
from idbench.identify.basis.twists import Twist
from idbench.identify.data.kinematics import INERTIAL

MX, M = INERTIAL.index("MX"), INERTIAL.index("M")

_UNITS: dict[Kind, str] = {"inertia": "kg m^2", "first moment": "kg m", "mass": "kg"}

_OF_LETTERS: tuple[Kind, ...] = ("inertia",) * 6 + ("first moment",) * 3 + ("mass",)

KINDS: dict[str, tuple[Kind, str]] = {x: (kind, _UNITS[kind]) for x, kind in zip(INERTIAL, _OF_LETTERS, strict=True)}
"""What the inertial parameters measure, and their units."""

NOTHING: Matrix = (ZERO, ZERO, ZERO)


class Wrench(NamedTuple):
    """Force M a + A MS and moment J (XX ... ZZ) + MS x a of a link with mass M and first moments MS."""

    a: Vector
    A: Matrix
    J: tuple[Vector, ...]

    @classmethod
    def inertial(cls, V: Twist, dV: Twist, up: Vector) -> Self:
        """Return force and moment that move a link, with its weight: a = dv + w x v - g, Newton and Euler."""
        v, w = V
        squares = times(w.x, w.x), times(w.y, w.y), times(w.z, w.z)
        xy, xz, yz = times(w.x, w.y), times(w.x, w.z), times(w.y, w.z)
        d = dV.w
        A = (
            Vector(times(-1.0, plus(squares[1], squares[2])), minus(xy, d.z), plus(xz, d.y)),
            Vector(plus(xy, d.z), times(-1.0, plus(squares[0], squares[2])), minus(yz, d.x)),
            Vector(minus(xz, d.y), plus(yz, d.x), times(-1.0, plus(squares[0], squares[1]))),
        )
        J = (
            Vector(d.x, xz, times(-1.0, xy)),
            Vector(minus(d.y, xz), plus(d.x, yz), minus(squares[0], squares[1])),
            Vector(plus(d.z, xy), minus(squares[2], squares[0]), minus(d.x, yz)),
            Vector(times(-1.0, yz), d.y, xy),
            Vector(minus(squares[1], squares[2]), minus(d.z, xy), plus(d.y, xz)),
            Vector(yz, times(-1.0, xz), d.z),
        )
        return cls(add(dV.v, cross(w, v), up), A, J)

    @classmethod
    def momentum(cls, V: Twist) -> Self:
        """Return momentum and angular momentum: a = v."""
        w = V.w
        minus_w = scaled(-1.0, w)
        A = Vector(0.0, minus_w.z, w.y), Vector(w.z, 0.0, minus_w.x), Vector(minus_w.y, w.x, 0.0)
        return cls(V.v, A, _inertia_times(w))

    @classmethod
    def weight(cls, up: Vector) -> Self:
        """Return what holds a link against gravity: a = -g."""
        return cls(up, NOTHING, (ZERO,) * 6)

    def along(self, twist: Twist, parameter: int) -> Term:
        """Return what a parameter, by its number in INERTIAL, adds to the power of force and moment along a unit motion."""
        if parameter < MX:
            return dot(twist.w, self.J[parameter])
        if parameter == M:
            return dot(twist.v, self.a)
        x, y, z = ((0, 1, 2), (1, 2, 0), (2, 0, 1))[parameter - MX]
        force = dot(Vector(*(row[x] for row in self.A)), twist.v)
        return plus(force, minus(times(self.a[y], twist.w[z]), times(self.a[z], twist.w[y])))


def _inertia_times(w: Vector) -> tuple[Vector, ...]:
    return (
        Vector(w.x, 0.0, 0.0),
        Vector(w.y, w.x, 0.0),
        Vector(w.z, 0.0, w.x),
        Vector(0.0, w.y, 0.0),
        Vector(0.0, w.z, w.y),
        Vector(0.0, 0.0, w.z),
    )


def energy(V: Twist, up: Vector, height: Term) -> tuple[Term, ...]:
    """Return what each parameter adds to kinetic plus potential energy."""
    v, w = V
    half = scaled(0.5, w)
    squares = times(half.x, w.x), times(w.x, w.y), times(w.x, w.z), times(half.y, w.y), times(w.y, w.z), times(half.z, w.z)
    return (*squares, *add(cross(v, w), up), plus(times(0.5, dot(v, v)), height))
