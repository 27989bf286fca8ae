"""Parameters that are known, and therefore not identified."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from typing import Self, final

from idbench.experiments.errors import ExperimentError
from idbench.identify import Basis
from idbench.identify.basis.block import BODY, FRICTION, Kind
from idbench.identify.plugins import did_you_mean

KINDS: Mapping[str, frozenset[Kind]] = {"links": BODY, "armatures": frozenset({"rotor inertia"}), "friction": FRICTION}
"""Groups of parameters that can be held together, at the values of the robot's file."""

FILE = "file"
"""Word for the value in the robot's file."""


@final
@dataclass(frozen=True)
class Known:
    """Values of parameters, by name; None stands for the value in the robot's file."""

    groups: tuple[str, ...]
    """Groups held at the file's values, of `KINDS`."""
    values: Mapping[str, float | None]
    """Single parameters."""

    @classmethod
    def of(cls, words: tuple[str, ...]) -> Self:
        """Return what words such as links=file, Ia3=0.1 or Fs2=file state.

        Raises
        ------
        ExperimentError
            If a word is none of these, or names a parameter twice.
        """
        groups, values = list[str](), dict[str, float | None]()
        for word in words:
            name, equals, stated = word.partition("=")
            value = _number(stated)
            if not (name and equals) or (value is None and stated != FILE):
                raise ExperimentError(f"--hold {word}: write NAME=VALUE, NAME=file, or {', '.join(f'{k}=file' for k in KINDS)}")
            if name in values or name in groups:
                raise ExperimentError(f"--hold: {name} is given twice")
            if name in KINDS:
                if value is not None:
                    raise ExperimentError(f"--hold {word}: {name} are held at the values of the file: {name}=file")
                groups.append(name)
            else:
                values[name] = value
        return cls(tuple(groups), values)

    def holding(self, basis: Basis, given: Mapping[str, float]) -> Basis:
        """Return a basis that holds what it has of these parameters, at these values or those that are given."""
        kinds = frozenset[Kind]().union(*(KINDS[group] for group in self.groups))
        held = {p.name: given.get(p.name, 0.0) for p in basis.parameters if p.kind in kinds}
        held |= {name: given.get(name, 0.0) if x is None else x for name, x in self.values.items() if name in basis.names}
        if len(held) == len(basis.names):
            raise ExperimentError("--hold holds all parameters: none is left to identify")
        return basis.holding(**held) if held else basis

    def require(self, *bases: Basis) -> None:
        """Raise ExperimentError if a parameter is none of the standard ones of a robot, nor one of its base parameters."""
        names = dict.fromkeys(name for basis in bases for name in basis.names)
        for name in self.values:
            if name not in names:
                hint = did_you_mean(name, list(names))
                raise ExperimentError(f"--hold: there is no parameter {name!r}{hint}; there are {', '.join(names)}")


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if isfinite(value) else None
