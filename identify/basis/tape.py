"""Formulas that remember how they were computed: NumPy code, run once on symbols in the place of numbers.

Zeros and ones of the robot vanish, and every value is computed once, as in customized symbolic models (W. Khalil and J.-F.
Kleinfinger, IEEE Journal of Robotics and Automation 3 (1987) 517-526).
"""

from collections.abc import Callable, Iterable
from typing import Any, TypeAlias

import numpy as np

OPERATIONS: dict[Any, str] = {
    np.add: "+",
    np.subtract: "-",
    np.multiply: "*",
    np.true_divide: "/",
    np.power: "**",
    np.negative: "negate",
    np.absolute: "abs",
    np.fabs: "abs",
    np.maximum: "max",
    np.minimum: "min",
    np.greater: ">",
    np.less: "<",
    np.greater_equal: ">=",
    np.less_equal: "<=",
    np.arctan: "atan",
    np.arcsinh: "asinh",
    **{same: same.__name__ for same in (np.sign, np.sqrt, np.hypot, np.copysign, np.exp, np.expm1, np.log, np.log1p)},
    **{same: same.__name__ for same in (np.sin, np.cos, np.tan, np.sinh, np.cosh, np.tanh)},
}
"""Functions of NumPy -> operations of a tape; those of functions are called like those of C."""

NUMBERS: dict[str, Callable[..., Any]] = {name: function for function, name in OPERATIONS.items()} | {"where": np.where}
"""Operations -> what they are of numbers."""

WHOLE = 4  # Powers up to this are products

Step: TypeAlias = tuple[Any, ...]
"""An operation and what it takes: numbers of earlier steps (int), or constants (float). Of an input, where it comes from."""


class Symbol:
    """The value of a step, one object a step: it equals itself alone, and no number."""

    __slots__ = ("number", "tape")

    def __init__(self, tape: "Tape", number: int) -> None:
        self.tape, self.number = tape, number

    def __add__(self, other: "Value") -> "Value":
        return self.tape.apply("+", self, other)

    __radd__ = __add__

    def __sub__(self, other: "Value") -> "Value":
        return self.tape.apply("-", self, other)

    def __rsub__(self, other: float) -> "Value":
        return self.tape.apply("-", other, self)

    def __mul__(self, other: "Value") -> "Value":
        return self.tape.apply("*", self, other)

    __rmul__ = __mul__

    def __neg__(self) -> "Value":
        return self.tape.apply("negate", self)

    def __array_ufunc__(self, function: Any, method: str, *of: "Value") -> "Value":
        return self.tape.apply(OPERATIONS[function], *of) if method == "__call__" and function in OPERATIONS else NotImplemented


Value: TypeAlias = Symbol | float
"""One value."""


class Tape:
    """What was computed, every value once."""

    def __init__(self) -> None:
        self.steps: list[Step] = []
        self.symbols: list[Symbol] = []
        self._known: dict[Step, Symbol] = {}

    def input(self, *source: Any) -> Symbol:
        """Return a value that is given; `source` says where."""
        return self._step("input", *source)

    def apply(self, operation: str, *of: Value) -> Value:
        """Return an operation on values, without what zeros and ones make of it."""
        if not any(isinstance(x, Symbol) for x in of):
            return float(NUMBERS[operation](*of))
        rule = _RULES.get(operation)
        simpler = rule(self, *of) if rule else None
        if simpler is not None:
            return simpler
        taken = [x.number if isinstance(x, Symbol) else float(x) for x in of]
        if operation in ("+", "*", "max", "min"):
            taken.sort(key=lambda x: (isinstance(x, int), x))
        return self._step(operation, *taken)

    def needed(self, wanted: Iterable[Value]) -> list[int]:
        """Return the numbers of all steps that values take, in order."""
        used = {x.number for x in wanted if isinstance(x, Symbol)}
        for number in reversed(range(max(used, default=-1) + 1)):
            if number in used:
                used.update(self.taken(number))
        return sorted(used)

    def taken(self, number: int) -> list[int]:
        """Return the numbers of the steps whose values a step takes."""
        operation, *of = self.steps[number]
        return [] if operation == "input" else [x for x in of if isinstance(x, int)]

    def _step(self, *step: Any) -> Symbol:
        key = tuple((type(x), x) for x in step)  # 5 and 5.0, a step and a constant, are equal to a dictionary
        if (known := self._known.get(key)) is None:
            known = self._known[key] = Symbol(self, len(self.steps))
            self.steps.append(step)
            self.symbols.append(known)
        return known

    def negated(self, x: Value) -> Value | None:
        """Return -x if x is a step that negates."""
        if not isinstance(x, Symbol):
            return -x
        operation, *of = self.steps[x.number]
        return self.symbols[of[0]] if operation == "negate" else None


def _sum(tape: Tape, a: Value, b: Value) -> Value | None:
    if a == 0.0 or b == 0.0:
        return b if a == 0.0 else a
    if isinstance(b, Symbol) and (less := tape.negated(b)) is not None:
        return tape.apply("-", a, less)
    if isinstance(a, Symbol) and (less := tape.negated(a)) is not None:
        return tape.apply("-", b, less)
    return None


def _difference(tape: Tape, a: Value, b: Value) -> Value | None:
    if b in (0.0, a):
        return a if b == 0.0 else 0.0
    if a == 0.0:
        return tape.apply("negate", b)
    if isinstance(b, Symbol) and (more := tape.negated(b)) is not None:
        return tape.apply("+", a, more)
    return None


def _product(tape: Tape, a: Value, b: Value) -> Value | None:
    a, b = (b, a) if isinstance(a, Symbol) and not isinstance(b, Symbol) else (a, b)
    if a in (0.0, 1.0):
        return b if a else 0.0
    if a == -1.0:
        return tape.apply("negate", b)
    if not isinstance(a, Symbol) and isinstance(b, Symbol):
        operation, *of = tape.steps[b.number]
        return tape.apply("*", a * of[0], tape.symbols[of[1]]) if operation == "*" and isinstance(of[0], float) else None
    for x, other in ((a, b), (b, a)):
        if isinstance(x, Symbol) and isinstance(other, Symbol) and tape.steps[x.number] == ("sign", other.number):
            return tape.apply("abs", other)
        if isinstance(x, Symbol) and (less := tape.negated(x)) is not None:
            return tape.apply("negate", tape.apply("*", less, other))
    return None


def _quotient(tape: Tape, a: Value, b: Value) -> Value | None:
    if a == 0.0:
        return 0.0
    return None if isinstance(b, Symbol) or b == 0.0 else tape.apply("*", a, 1.0 / b)


def _power(tape: Tape, a: Value, b: Value) -> Value | None:
    if isinstance(b, Symbol) or b not in range(WHOLE + 1):
        return tape.apply("sqrt", a) if b == 0.5 else None
    half = tape.apply("**", a, b // 2) if b > 1 else 1.0
    return tape.apply("*", tape.apply("*", half, half), a) if b % 2 else tape.apply("*", half, half)


_RULES: dict[str, Callable[..., Value | None]] = {
    "+": _sum,
    "-": _difference,
    "*": _product,
    "/": _quotient,
    "**": _power,
    "negate": Tape.negated,
    "where": lambda _, condition, a, b: None if isinstance(condition, Symbol) else a if condition else b,
}
