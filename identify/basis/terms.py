"""Vectors whose components are signals or constants; products with 0 and 1 are never computed.

Axes of robots are mostly parallel to those of their frames, so that most components of their geometry are 0 or 1 at all times.
"""

from typing import NamedTuple, TypeAlias

from idbench.identify.arrays import Array

Term: TypeAlias = Array | float
"""A signal (..., time), or what it is at all times."""


class Vector(NamedTuple):
    """Three components."""

    x: Term
    y: Term
    z: Term


Matrix: TypeAlias = tuple[Vector, Vector, Vector]
"""Three rows."""

ZERO = Vector(0.0, 0.0, 0.0)


def is_zero(a: Term) -> bool:
    """Return whether a term is zero at all times."""
    return isinstance(a, float) and a == 0.0


def times(a: Term, b: Term) -> Term:
    """Return a b."""
    if isinstance(b, float):
        a, b = b, a
    if isinstance(a, float):
        if a == 0.0:
            return 0.0
        if a == 1.0:
            return b
        if a == -1.0:
            return -b
    return a * b


def plus(*terms: Term) -> Term:
    """Return the sum."""
    total: Term = 0.0
    for term in terms:
        if not is_zero(term):
            total = term if is_zero(total) else total + term
    return total


def minus(a: Term, b: Term) -> Term:
    """Return a - b."""
    if is_zero(b):
        return a
    return -b if is_zero(a) else a - b


def add(*vectors: Vector) -> Vector:
    """Return the sum of vectors."""
    return Vector(*(plus(*components) for components in zip(*vectors, strict=True)))


def scaled(a: Term, v: Vector) -> Vector:
    """Return a v."""
    return Vector(times(a, v.x), times(a, v.y), times(a, v.z))


def dot(a: Vector, b: Vector) -> Term:
    """Return a' b."""
    return plus(times(a.x, b.x), times(a.y, b.y), times(a.z, b.z))


def cross(a: Vector, b: Vector) -> Vector:
    """Return a x b."""
    return Vector(
        minus(times(a.y, b.z), times(a.z, b.y)),
        minus(times(a.z, b.x), times(a.x, b.z)),
        minus(times(a.x, b.y), times(a.y, b.x)),
    )


def apply(M: Matrix, v: Vector) -> Vector:
    """Return M v."""
    return Vector(*(dot(row, v) for row in M))


def transposed(M: Matrix) -> Matrix:
    """Return M'."""
    x, y, z = M
    return Vector(x.x, y.x, z.x), Vector(x.y, y.y, z.y), Vector(x.z, y.z, z.z)


def vector(values: Array) -> Vector:
    """Return a vector of constants."""
    return Vector(*(float(value) for value in values))


def matrix(values: Array) -> Matrix:
    """Return a matrix of constants."""
    x, y, z = (vector(row) for row in values)
    return x, y, z
