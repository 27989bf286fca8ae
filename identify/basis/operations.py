"""The cost of the columns: operations per sample, counted by evaluating them once on symbols."""

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from idbench.identify.basis.basis import Basis
from idbench.identify.basis.joint_law import AbstractJointLaw
from idbench.identify.signals.signals import State

COLUMNS = {
    "explicit": ("explicit",),
    "implicit": ("remainder", "momentum"),
    "power": ("dissipation", "energy"),
}
"""Model -> the columns c and e that it takes from a basis."""


@dataclass(frozen=True)
class Operations:
    """Operations per sample of the columns of a model; a value that is used several times counts once."""

    multiplications: int
    """Of two values, or of a value and a constant that is not 0, 1 or -1."""
    additions: int
    """And subtractions, but for those of 0."""
    functions: int
    """Sines, cosines, and others that laws of friction have."""
    differentiated: int
    """Columns that are still to be differentiated."""

    def __str__(self) -> str:
        counts = {
            "multiplications": self.multiplications,
            "additions": self.additions,
            "functions": self.functions,
            "derivatives": self.differentiated,
        }
        return ", ".join(f"{count} {name}" for name, count in counts.items() if count)

    @property
    def total(self) -> int:
        """Multiplications and additions."""
        return self.multiplications + self.additions


def operations(basis: Basis, model: str) -> Operations:
    """Return the operations per sample of the columns of a model: explicit, implicit or power.

    The basis computes its columns once with symbols in the place of numbers, so that zeros and ones of the robot vanish, as
    in customized symbolic models (W. Khalil and J.-F. Kleinfinger, IEEE Journal of Robotics and Automation 3 (1987) 517-526).
    Signs and absolute values cost nothing, and neither does a law that is linearized about an estimate.

    Examples
    --------
    >>> from idbench.identify import scara
    >>> operations(scara(), "explicit").total > operations(scara(), "power").total
    True
    """
    tape = _Tape()
    signals = (np.array([[tape.value("input", f"{name}{j}")] for j in range(basis.n)]) for name in ("q", "qd", "qdd"))
    q, qd, qdd = signals
    state = State(q, qd, lambda _: qdd, {"temperature": q, "payload": q[:1]})
    columns = {what: list(_columns(basis, state, what)) for what in COLUMNS[model]}
    counts = tape.counts([symbol for each in columns.values() for symbol in each])
    held = sum(len(columns.get(what, ())) for what in ("momentum", "energy"))
    return Operations(counts["*"], counts["+"], counts["function"], held)


def _columns(basis: Basis, state: State, what: str) -> Iterator["_Symbol"]:
    """Yield the columns of all blocks that are not constant."""
    for block in basis.blocks:
        if isinstance(block, AbstractJointLaw):  # whose own functions refuse what is no number
            shares: dict[str, Any] = {"explicit": 1.0, "remainder": 1.0, "dissipation": state.qd}
            found = [x for torque in block.torques(state).values() for x in np.ravel(torque * shares.get(what, 0.0))]
        else:
            found = [np.ravel(x)[0] for x in getattr(block, what)(state).values()]
        yield from (x for x in found if isinstance(x, _Symbol))


@final
class _Symbol:
    """A value that remembers how it was made."""

    __slots__ = ("number", "tape")

    def __init__(self, tape: "_Tape", number: int) -> None:
        self.tape, self.number = tape, number

    def __mul__(self, other: Any) -> Any:
        if not isinstance(other, _Symbol) and float(other) in (0.0, 1.0, -1.0):
            return {0.0: 0.0, 1.0: self}.get(float(other), -self)
        return self.tape.value("*", *sorted(map(_key, (self, other)), key=str))

    __rmul__ = __mul__

    def __add__(self, other: Any) -> Any:
        if not isinstance(other, _Symbol) and float(other) == 0:
            return self
        return self.tape.value("+", *sorted(map(_key, (self, other)), key=str))

    __radd__ = __add__

    def __sub__(self, other: Any) -> Any:
        return self + -1.0 * other

    def __rsub__(self, other: Any) -> Any:
        return -self + other

    def __neg__(self) -> "_Symbol":
        return self.tape.value("-", self.number)

    def __truediv__(self, other: Any) -> Any:
        return self * (1 / other)

    def __rtruediv__(self, other: float) -> Any:
        return other * self.tape.value("function", "1 /", self.number)

    def __pow__(self, power: float) -> Any:
        if power in (1, 2, 3):
            return self if power == 1 else self * self ** (power - 1)
        return self.tape.value("function", f"** {power}", self.number)

    def __abs__(self) -> "_Symbol":
        return self

    def __gt__(self, other: Any) -> bool:
        return True

    __ge__ = __gt__

    def __lt__(self, other: Any) -> bool:
        return False

    __le__ = __lt__

    def __getattr__(self, name: str) -> Callable[[], "_Symbol"]:
        """Return what a function of NumPy, such as `numpy.cos`, calls of an object."""
        if name.startswith("_"):
            raise AttributeError(name)
        return lambda: self.tape.value("function", name, self.number)


def _key(x: Any) -> int | str:
    """Return the number of a symbol, or a constant as text."""
    return x.number if isinstance(x, _Symbol) else repr(float(x))


@final
class _Tape:
    """What was computed, every value once."""

    def __init__(self) -> None:
        self._known: dict[tuple[Any, ...], _Symbol] = {}
        self._made: list[tuple[Any, ...]] = []

    def value(self, operation: str, *of: Any) -> _Symbol:
        """Return the value of an operation on others."""
        key = (operation, *of)
        if key not in self._known:
            self._known[key] = _Symbol(self, len(self._made))
            self._made.append(key)
        return self._known[key]

    def counts(self, wanted: list[_Symbol]) -> Counter[str]:
        """Return the number of operations of each kind: a value v = f(a, b) takes one f beside those of a and b."""
        used, todo = set[int](), [symbol.number for symbol in wanted]
        while todo:
            if (number := todo.pop()) not in used:
                used.add(number)
                todo += [x for x in self._made[number][1:] if isinstance(x, int)]
        return Counter(self._made[number][0] for number in used)
