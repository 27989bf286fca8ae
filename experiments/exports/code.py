"""Formulas as straight-line code of a language."""

import keyword
import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib.resources import files
from string import Template

from idbench.experiments.exports.functions import Function, RobotFunctions
from idbench.identify.basis.tape import Step, Symbol, Tape

TRAINING = ("_mjlab.py", "_isaaclab.py", "_playground.py")  # Endings of code beside ranges, for training frameworks
BAND = "_band.svg"  # Ending of the picture of free runs beside them
LONG = 100  # Characters of an expression that is not written into another one: a line stays readable

C_WORDS = (
    "auto break case char const continue default do double else enum extern float for goto if inline int long register "
    "restrict return short signed sizeof static struct switch typedef union unsigned void volatile while"
)
"""Words of C99 that can be no names."""

RESERVED = frozenset({*keyword.kwlist, *C_WORDS.split(), "half_width", "fitted_speed", "fitted_torque", "temperature"})
"""What no parameter can be called in the code."""

OPERATIONS = {
    "+": "({} + {})",
    "-": "({} - {})",
    "*": "({} * {})",
    "/": "({} / {})",
    "negate": "(-{})",
    ">": "({} > {})",
    "<": "({} < {})",
    ">=": "({} >= {})",
    "<=": "({} <= {})",
}
"""What all languages write alike: templates of operands."""


@dataclass(frozen=True)
class Language:
    """How a language writes formulas."""

    operations: Mapping[str, str]
    """Operation -> a template of its operands; those that are missing are calls of functions by their names."""
    number: Callable[[float], str]
    """Writes a constant."""
    input: Callable[[Step], str]
    """Writes an input."""
    assigned: str
    """Template of a name and its expression."""


def body(language: Language, tape: Tape, function: Function) -> tuple[list[str], list[str], set[str]]:
    """Return lines that compute a function, expressions of its results, and the operations that are called.

    A value that is used once stands where it is used, as long as the expression stays short.
    """
    needed = tape.needed(function.values)
    uses = Counter(x for number in needed for x in tape.taken(number))
    uses.update(x.number for x in function.values if isinstance(x, Symbol))
    text = dict[int, str]()
    lines = list[str]()
    called = set[str]()
    for number in needed:
        operation, *of = step = tape.steps[number]
        if operation == "input":
            text[number] = language.input(step)
            continue
        operands = [text[x] if isinstance(x, int) else language.number(x) for x in of]
        template = language.operations.get(operation)
        called |= {operation} if template is None else set()
        made = f"{operation}({', '.join(map(_bare, operands))})" if template is None else template.format(*operands)
        if uses[number] > 1 or len(made) > LONG:
            name = f"t{len(lines) + 1}"
            lines.append(language.assigned.format(name, _bare(made)))
            made = name
        text[number] = made
    results = [_bare(text[x.number]) if isinstance(x, Symbol) else language.number(x) for x in function.values]
    return lines, results, called


def _bare(text: str) -> str:
    """Return an expression without the parentheses around all of it."""
    if not (text.startswith("(") and text.endswith(")")):
        return text
    depth = 0
    for place, character in enumerate(text):
        depth += {"(": 1, ")": -1}.get(character, 0)
        if depth == 0:
            return text[1:-1] if place == len(text) - 1 else text
    return text


def identifiers(names: Sequence[str]) -> list[str]:
    """Return names as identifiers of languages, no two alike."""
    found = list[str]()
    for name in names:
        plain = re.sub(r"\W", "_", name, flags=re.ASCII)
        plain = plain if re.match(r"[A-Za-z]", plain) else f"p_{plain}"
        while plain in found or plain in RESERVED:
            plain += "_"
        found.append(plain)
    return found


def template(name: str) -> Template:
    """What a written file says of every robot, with $words in the places of what varies."""
    return Template(files("idbench.experiments.exports").joinpath(f"{name}.txt").read_text(encoding="utf-8"))


@dataclass(frozen=True, eq=False)
class Content:
    """What a file of functions holds."""

    functions: RobotFunctions
    """The functions."""
    values: Sequence[float]
    """The parameters' values, as identified."""
    sigma: Sequence[float]
    """Their standard errors."""
    interval: Mapping[str, Sequence[float]]
    """Of each joint: half widths of the torques' intervals, speeds and torques of the fit; NaN where they are not known."""
    origin: str
    """From which logs, by which model and estimator, and which version of the program."""

    @cached_property
    def names(self) -> list[str]:
        """The parameters' names in the code."""
        return identifiers(self.functions.basis.names)

    def input(self, step: Step, parameter: str, signal: str) -> str:
        """Return an input by templates of a parameter's name, and of a signal's name and number."""
        if step[1] == "parameter":
            return parameter.format(self.names[step[2]])
        return signal.format(step[1], step[2])
