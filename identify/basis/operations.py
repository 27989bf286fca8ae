"""The cost of the columns: operations per sample, counted by evaluating them once on symbols."""

from collections import Counter
from dataclasses import asdict, dataclass

from idbench.identify.basis.basis import Basis
from idbench.identify.basis.loads import HELD_SHARE
from idbench.identify.basis.replay import motion_of_symbols
from idbench.identify.basis.symbols import flat, inputs
from idbench.identify.basis.tape import Symbol, Tape
from idbench.identify.signals.signals import State

COLUMNS = {"explicit": ("explicit",), "implicit": ("remainder", "momentum"), "power": ("dissipation", "energy")}
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
    derivatives: int
    """Columns that are still to be differentiated."""

    def __str__(self) -> str:
        return ", ".join(f"{count} {name}" for name, count in asdict(self).items() if count)

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
    tape = Tape()
    state = recorded_state(tape, basis.n)
    columns = {
        what: [x for block in basis.blocks for column in getattr(block, what)(state).values() for x in flat(column)]
        for what in COLUMNS[model]
    }
    needed = tape.needed(x for each in columns.values() for x in each)
    counts = Counter(_COUNTED.get(tape.steps[number][0], "functions") for number in needed)
    held = sum(isinstance(x, Symbol) for what in ("momentum", "energy") for x in columns.get(what, ()))
    return Operations(counts["multiplications"], counts["additions"], counts["functions"], held)


_FREE = ("input", "negate", "abs", "sign", ">", "<", ">=", "<=", "where", "max", "min")
_COUNTED = {"+": "additions", "-": "additions", "*": "multiplications", **dict.fromkeys(_FREE, "nothing")}


def recorded_state(tape: Tape, n: int) -> State:
    """Return a motion of symbols: inputs q, qd, qdd, temperature and payload."""
    q, qd, qdd = (inputs(tape, name, n) for name in ("q", "qd", "qdd"))
    conditions = {"temperature": inputs(tape, "temperature", n), HELD_SHARE: inputs(tape, HELD_SHARE, 1)}
    return motion_of_symbols(q, qd, qdd, conditions=conditions)
