"""What a study varies."""

from collections.abc import Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from dataclasses import field as field_of
from functools import cached_property
from itertools import product
from typing import Any, Literal

import numpy as np

from idbench.experiments.errors import ExperimentError, StudyError
from idbench.experiments.identification.chain_settings import replaced
from idbench.experiments.identification.method import Method
from idbench.identify import CHAINS, ESTIMATORS
from idbench.sim.settings import Number, Whole, settings

MOST_VALUES = 10000  # Values of an axis above which it is taken for a slip

SERVO = "servo"  # Name of the model of servos in results

FRICTION = "friction laws"
"""Field of the axis of the laws of friction that are identified; `friction` is that of the simulated robot."""


@settings
class Axis:
    """A setting and the values that it takes, listed or evenly spaced."""

    field: str
    """A setting of the scenario, such as encoder.lines, or of identification: chain.operator.cutoff, estimator.rounds. Of
    cases: any name."""
    values: tuple[Any, ...] = ()
    """The values; for a stage of the chain, such as chain.operator, names of plug-ins, or tables { kind = NAME, ... }."""
    lowest: Number | None = None
    """Instead of values: the first of evenly spaced ones."""
    highest: Number | None = None
    """The last of them."""
    count: Whole | None = None
    """How many, at least 2."""
    spacing: Literal["linear", "log"] = "linear"
    """Even differences, or even ratios."""
    also: tuple[str, ...] = ()
    """Further fields that take the same value."""
    cases: dict[str, dict[str, Any]] = field_of(default_factory=dict)
    """Instead of values: named tables of settings of the scenario that change together."""

    def __post_init__(self) -> None:
        spaced = self.lowest, self.highest, self.count
        if self.values or self.cases:
            if any(x is not None for x in spaced) or (self.values and self.cases):
                raise ValueError(f"axis {self.field}: give values, or lowest, highest and count, or cases: one of them")
            if self.cases and (self.also or self.identification):
                raise ValueError(f"axis {self.field}: cases are settings of a scenario, and have no also")
        elif None in spaced:
            raise ValueError(f"axis {self.field} is empty: give values, or lowest, highest and count, or cases")
        elif not 2 <= (self.count or 0) <= MOST_VALUES or not (self.lowest or 0.0) < (self.highest or 0.0):
            raise ValueError(f"axis {self.field}: lowest must be below highest, and count between 2 and {MOST_VALUES}")
        elif self.spacing == "log" and (self.lowest or 0.0) <= 0:
            raise ValueError(f"axis {self.field}: lowest = {self.lowest:g} must be above 0 for spacing log")
        if len({self.label(value) for value in self.points}) < len(self.points):
            raise ValueError(f"axis {self.field}: a value is given twice in {list(self.points)!r:.200}")
        if not self.field:
            raise ValueError("field is empty: name a setting, or what the cases are")
        kinds = {_of_identification(field) for field in self.all_fields}
        if len(kinds) > 1:
            raise ValueError(f"axis {self.field}: also = {list(self.also)} mixes settings of simulation and identification")

    @cached_property
    def points(self) -> tuple[Any, ...]:
        """The values, those inside a range to six digits."""
        if self.values or self.cases:
            return self.values or tuple(self.cases)
        low, high = self.lowest or 0.0, self.highest or 0.0
        space = np.geomspace if self.spacing == "log" else np.linspace
        return (low, *(float(f"{x:.6g}") for x in space(low, high, self.count or 0)[1:-1]), high)

    @cached_property
    def numeric(self) -> bool:
        """Whether all values are numbers."""
        return all(isinstance(v, (int, float)) and not isinstance(v, bool) and v == v for v in self.points)  # noqa: PLR0124

    def label(self, value: Any) -> float | str:
        """Return a value as it stands in results: a number if all of the axis are, else text."""
        if self.numeric:
            return float(value)
        if isinstance(value, dict) and isinstance(value.get("kind"), str):
            return ", ".join([value["kind"], *(f"{key} {x}" for key, x in value.items() if key != "kind")])
        return value if isinstance(value, str) else repr(_plain(value))

    @property
    def all_fields(self) -> tuple[str, ...]:
        """Every field that takes the value, and every setting that a case changes."""
        return (self.field, *self.also, *dict.fromkeys(path for case in self.cases.values() for path in paths_of(case)))

    @property
    def identification(self) -> bool:
        """Whether it is a setting of identification: the same simulations serve all its values."""
        return _of_identification(self.field)


@dataclass(frozen=True)
class Setting:
    """One value of one axis."""

    axis: Axis
    value: Any

    @property
    def label(self) -> float | str:
        """The value as it stands in results."""
        return self.axis.label(self.value)

    def into(self, content: dict[str, Any]) -> None:
        """Write the value into the tables of a scenario."""
        if self.axis.cases:
            merged = merge(content, deepcopy(self.axis.cases[self.value]))
            content.clear()
            content.update(merged)
            return
        for field in self.axis.all_fields:
            *path, key = field.split(".")
            table = content
            for i, part in enumerate(path):
                table = table.setdefault(part, {})
                if not isinstance(table, dict):
                    raise StudyError(f"axis {field}: {'.'.join(path[: i + 1])} is no table of settings")
            named = field == "trajectory" and isinstance(self.value, str)  # that of another scenario
            if named or isinstance(self.value, dict) or key not in table or not isinstance(table[key], dict):
                table[key] = deepcopy(self.value)
            else:
                raise StudyError(f"axis {field} is a table of settings: give tables as values, or name one of its settings")

    def applied(self, part: Any, name: str) -> Any:
        """Return a chain or an estimator, as `name` says, with this value if it is one of its own; raise StudyError."""
        for field in self.axis.all_fields:
            root, *path = field.split(".")
            if root == name:
                try:
                    part = replaced(part, path, self.value)
                except ExperimentError as error:
                    sets = "no such setting" in str(error)
                    raise StudyError(f"axis {field}{'' if sets else f' = {self.value!r:.60}'}: {error}") from error
        return part


def paths_of(table: Mapping[str, Any], above: str = "") -> Iterator[str]:
    """Yield the dotted names of all settings of nested tables."""
    for key, value in table.items():
        yield from paths_of(value, f"{above}{key}.") if isinstance(value, dict) else (f"{above}{key}",)


def merge(content: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings with changes, table by table; a part of another kind is replaced whole."""
    result = dict(content)
    for key, value in changes.items():
        old = result.get(key)
        if isinstance(old, dict) and isinstance(value, dict) and value.get("kind", old.get("kind")) == old.get("kind"):
            result[key] = merge(old, value)
        else:
            result[key] = value
    return result


def _of_identification(field: str) -> bool:
    return field == FRICTION or field.split(".", maxsplit=1)[0] in ("chain", "estimator")


def _plain(value: Any) -> Any:
    return [_plain(x) for x in value] if isinstance(value, (list, tuple)) else value


@dataclass(frozen=True)
class Combination:
    """Chain, estimator and laws of friction, with settings along the axes; all models of a study are identified with it."""

    method: Method
    friction: str
    settings: tuple[Setting, ...]

    def fits(self, chain: str, estimator: str, settings: Mapping[str, Any]) -> bool:
        """True if it has this chain and estimator, and the values of the axes where they are given."""
        if (chain, estimator) != (self.method.chain_name, self.method.estimator_name):
            return False
        return all(settings.get(s.axis.field, s.label) == s.label for s in self.settings)


def methods_of(chains: Sequence[str], estimators: Sequence[str], friction: str, axes: Sequence[Axis]) -> Iterator[Combination]:
    """Yield every combination of chains, estimators and the values of axes; estimators that see no chain with the first."""
    for name, way, combination in product(chains, estimators, list(combinations(axes))):
        chain, estimator = CHAINS.create(name), ESTIMATORS.create(way)
        if name != chains[0] and not estimator.filtered:
            continue
        for setting in whole_first(combination):
            chain, estimator = setting.applied(chain, "chain"), setting.applied(estimator, "estimator")
        laws = next((str(setting.value) for setting in combination if setting.axis.field == FRICTION), friction)
        yield Combination(Method(name, way, chain, estimator), laws, combination)


def servo_methods(friction: str, axes: Sequence[Axis]) -> Iterator[Combination]:
    """Yield what the closed loop of servos is fitted with: every law of friction."""
    method = replace(Method.named(), chain_name="commands", estimator_name="closed loop")  # chain and estimator see no servo
    for combination in combinations(axes):
        laws = next((str(setting.value) for setting in combination if setting.axis.field == FRICTION), friction)
        yield Combination(method, laws, combination)


def combinations(axes: Sequence[Axis]) -> Iterator[tuple[Setting, ...]]:
    """Yield every combination of the axes' values, the last axis fastest."""
    return product(*([Setting(axis, value) for value in axis.points] for axis in axes))


def whole_first(combination: tuple[Setting, ...]) -> list[Setting]:
    """Return settings such that a part that is replaced whole does not undo a setting of that part."""
    return sorted(combination, key=lambda setting: setting.axis.field.count("."))
