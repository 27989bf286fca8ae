"""Parameters that are known, and not identified, or roughly known."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf, isfinite
from typing import Self

import numpy as np

from idbench.experiments.errors import ExperimentError
from idbench.identify import Array, BaseParameters, Basis
from idbench.identify.basis.block import BODY, FRICTION, Kind
from idbench.identify.parameters.prior import FilePrior, normal_prior, prior_sum
from idbench.identify.plugins import did_you_mean
from idbench.identify.rows.factors import Prior

KINDS: Mapping[str, frozenset[Kind]] = {"links": BODY, "armatures": frozenset({"rotor inertia"}), "friction": FRICTION}
"""Groups of parameters that can be held together, at the values of the robot's file."""

FILE = "file"  # Word for the value in the robot's file


@dataclass(frozen=True)
class Known:
    """Values of parameters, by name; None stands for the value in the robot's file."""

    groups: tuple[str, ...]
    """Groups held at the file's values, of `KINDS`."""
    values: Mapping[str, float | None]
    """Single parameters."""

    @classmethod
    def of(cls, words: tuple[str, ...]) -> Self:
        """Known parameters from words such as links=file, Ia3=0.1 or Fs2=file.

        Raises
        ------
        ExperimentError
            If a word is none of these, or names a parameter twice.
        """
        groups, values = list[str](), dict[str, float | None]()
        for word in words:
            name, equals, stated = word.partition("=")
            value = number_of(stated)
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


SHARE = 1.0  # Relative change of the links of a file that is expected where nobody says it and no log has been asked


@dataclass(frozen=True)
class Trust:
    """A value that is roughly known."""

    value: float | None
    """The value; None stands for that of the robot's file."""
    sigma: float
    """Its standard deviation, as a share of the value where that is `relative`."""
    relative: bool
    """Whether it is a share."""

    def of(self, filed: float) -> tuple[float, float]:
        """Return value and standard deviation, with the value of the file."""
        value = filed if self.value is None else self.value
        return value, self.sigma * abs(value) if self.relative else self.sigma


@dataclass(frozen=True)
class RoughlyKnown:
    """What is roughly known: links near the file, and values of parameters with their standard deviations."""

    links: bool
    """Whether links are near those of the file."""
    share: float | None
    """Relative change of them that is expected; None if the log shall decide."""
    values: Mapping[str, Trust]
    """Parameters, letters that stand for those of all joints, or groups of `KINDS` but for links."""

    @classmethod
    def of(cls, words: tuple[str, ...]) -> Self:
        """Roughly known parameters from words such as file, file:25%, Ia=0.1:30% or Fs2=file:0.02.

        Raises
        ------
        ExperimentError
            If a word is none of these, or names something twice.
        """
        links, values = False, dict[str, Trust]()
        share: float | None = None
        for word in words:
            name, equals, stated = word.partition("=")
            first, _, trust = (stated if equals else word).partition(":")
            sigma, relative = number_of(trust.removesuffix("%")), trust.endswith("%")
            sigma = sigma / 100 if sigma is not None and relative else sigma
            wrong = bool(trust) and not (sigma is not None and sigma > 0)
            if not equals and first == FILE and not wrong and not links:
                links, share = True, sigma
                continue
            value = number_of(first)
            if not equals or not name or wrong or sigma is None or (value is None and first != FILE) or name in values:
                raise ExperimentError(
                    f"--prior {word}: write file, file:25% (links near the robot's file), NAME=VALUE:30%, NAME=VALUE:SIGMA or "
                    "NAME=file:30%, each name once"
                )
            if name == "links" or (name in KINDS and value is not None):
                raise ExperimentError(f"--prior {word}: write file:25% for links, {name}=file:25% for the others of a kind")
            values[name] = Trust(value, sigma, relative)
        return cls(links, share, values)

    def prior(self, grouping: BaseParameters, basis: Basis, filed: Array, share: float | None) -> Prior:
        """Prior of the parameters of a basis, `filed` being the standard ones of the robot's file.

        Raises
        ------
        ExperimentError
            If a name is none of the robot's, or all that is made of it has parts that are not known.
        """
        K = grouping.K[[grouping.basis.places[parameter] for parameter in basis.parameters]]
        standard = grouping.standard.parameters
        parts, known, stated = list[Prior](), np.full(len(standard), inf), filed.copy()
        for name, trust in self.values.items():
            if name in basis.names and name not in grouping.standard.names:
                place = basis.names.index(name)
                value, sigma = trust.of(float(K[place] @ filed))
                _require_sigma(name, sigma)
                parts.append(normal_prior(np.eye(len(basis.names))[:, [place]], np.array([value]), np.array([sigma])))
                continue
            places = [i for i, p in enumerate(standard) if name in (p.name, p.symbol) or p.kind in KINDS.get(name, ())]
            if not places:
                hint = did_you_mean(name, [*grouping.standard.names, *basis.names])
                raise ExperimentError(f"--prior: there is no parameter {name!r}{hint}")
            for i in places:
                stated[i], known[i] = trust.of(filed[i])
                _require_sigma(standard[i].name, known[i])
        if np.isfinite(known).any():
            used = (K[:, np.isfinite(known)] != 0).any(axis=1) & ~(K[:, ~np.isfinite(known)] != 0).any(axis=1)
            if idle := [standard[i].name for i in np.flatnonzero(np.isfinite(known)) if not (K[used, i] != 0).any()]:
                raise ExperimentError(
                    f"--prior: {_grouped(grouping, idle)}: say of all parts, hold them (--hold), or leave it out"
                )
            parts.append(normal_prior(K, stated, known))
        if self.links:
            if given := {p.name for p in (*grouping.standard.held, *grouping.standard.tied) if p.kind in BODY}:
                raise ExperimentError(
                    f"--prior file: {', '.join(sorted(given))} is held or tied, but links are near the file's as a whole: "
                    "leave one out"
                )
            parts.append(FilePrior(K, standard, filed, share or self.share or SHARE))
        return parts[0] if len(parts) == 1 else prior_sum(parts)


def _require_sigma(name: str, sigma: float) -> None:
    if not sigma > 0:
        raise ExperimentError(f"--prior: {name} is 0, of which a share is nothing: give a sigma, as in {name}=0:0.1")


def _grouped(grouping: BaseParameters, names: Sequence[str]) -> str:
    """Sentence on the base parameters in which parameters are grouped with others."""
    made = [f"{base} = {text}" for base, text in grouping.groupings.items() if any(name in text.split() for name in names)]
    return f"no base parameter is made of {', '.join(names)} alone ({'; '.join(made[:3]) or 'they move nothing'})"


def number_of(text: str) -> float | None:
    """Finite number that a text states; None if it states none."""
    try:
        value = float(text)
    except ValueError:
        return None
    return value if isfinite(value) else None
