"""Scenarios as TOML: read with every key checked, written with every key explained."""

from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import tomli_w

from idbench.identify.plugins import PluginTable, did_you_mean
from idbench.sim.controllers import CONTROLLERS
from idbench.sim.drives import DRIVES
from idbench.sim.encoders import ENCODERS
from idbench.sim.errors import ScenarioError
from idbench.sim.frictions import FRICTIONS
from idbench.sim.scenario.scenario import Scenario
from idbench.sim.settings import description, for_all_joints, limits, make, read_toml
from idbench.sim.trajectories import TRAJECTORIES

LONGEST = 1500  # Letters from which on a table comes after the others
LONG = 60  # Characters beyond which a value stands on lines of its own

FOLDER = Path(__file__).parent / "scenarios"

KINDS: Mapping[str, PluginTable[Any]] = {
    "trajectory": TRAJECTORIES,
    "controller": CONTROLLERS,
    "drive": DRIVES,
    "friction": FRICTIONS,
    "encoder": ENCODERS,
}
"""The parts of a scenario that are plug-ins: their tables say `kind` which."""


OF_0_1_0 = ("waypoints", "durations", "rest")
"""What a scenario of idbench 0.1.0 has at its top, and later ones in their trajectory."""


def names() -> tuple[str, ...]:
    """Return the names of the scenarios that ship."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.toml")))


def designed() -> tuple[str, ...]:
    """Return the names of the scenarios that ship with motions of `idbench excite`, such as excited/scara-sigma."""
    return tuple(sorted(path.relative_to(FOLDER).with_suffix("").as_posix() for path in FOLDER.glob("*/*.toml")))


def load(name: str | Path) -> Scenario:
    """Return the scenario that ships as `name`, or that of a TOML file.

    Raises
    ------
    ScenarioError
        If there is none, it is not TOML, or a key is unknown, missing, of the wrong type or out of its range.

    Examples
    --------
    >>> from idbench.sim import load_scenario
    >>> load_scenario("quantization").encoder.lines
    (4096,)
    """
    if not isinstance(name, str | Path):
        raise ScenarioError(f"{name!r:.60} is no scenario: give its name, or its file")
    content = _content(str(name))
    try:
        return from_dict(content)
    except ScenarioError as error:
        raise ScenarioError(f"scenario {name}: {error}") from error


def _content(name: str) -> dict[str, Any]:
    """Return the TOML document of a scenario."""
    path = Path(name) if name.endswith(".toml") else FOLDER / f"{name}.toml"
    if not name.endswith(".toml") and name not in (*names(), *designed()):
        hint = did_you_mean(name, (*names(), *designed()))
        raise ScenarioError(f"no scenario {name!r}{hint}; known: {', '.join(names())}, or give the path of a TOML file (.toml)")
    return read_toml(path, "scenario")


def from_dict(content: Mapping[str, Any]) -> Scenario:
    """Make a scenario from the keys of a TOML document; raise ScenarioError as `load`."""
    made = dict(content)
    if isinstance(made.get("fault"), dict):
        raise ScenarioError("[fault] needs two brackets, [[fault]]: there may be several")
    if "trajectory" not in made and (old := [key for key in OF_0_1_0 if key in made]):
        raise ScenarioError(
            f'this is a scenario of idbench 0.1.0: write {", ".join(old)} below a line [trajectory], with kind = "quintic"'
        )
    if isinstance(other := made.get("trajectory"), str):  # that of another scenario, which must be its own
        made["trajectory"] = _content(other).get("trajectory")
        if isinstance(made["trajectory"], str):
            raise ScenarioError(f"trajectory = {other!r}: that scenario has none of its own; name {made['trajectory']!r}")
    wrong = []
    for key, table in KINDS.items():
        if key in made and not isinstance(made[key], table.kind):
            try:
                made[key] = _plugin(key, table, made[key])
            except ScenarioError as error:  # with whatever else is wrong
                wrong.append(str(error))
                made.pop(key)
    try:
        scenario: Scenario = make(Scenario, made, "")
    except ScenarioError as error:
        rest = str(error).split("; ")  # but for keys that were taken out because they are wrong themselves
        rest = [part for part in rest if not any(part.startswith(f"key {key!r} is missing") for key in content)]
        raise ScenarioError("; ".join([*wrong, *rest])) from error
    if wrong:
        raise ScenarioError("; ".join(wrong))
    return scenario


def _plugin(key: str, table: PluginTable[Any], content: Mapping[str, Any]) -> Any:
    """Return the plug-in that a table with a `kind` describes."""
    if not isinstance(content, dict):
        raise ScenarioError(f"{key} = {content!r:.60} must be a table with a kind: {', '.join(table)}")
    if "kind" not in content:
        raise ScenarioError(f"key '{key}.kind' is missing; known: {', '.join(table)}")
    kind, rest = content["kind"], {name: value for name, value in content.items() if name != "kind"}
    if not isinstance(kind, str) or kind not in table:
        hint = did_you_mean(str(kind), list(table))
        raise ScenarioError(f"{key}.kind = {kind!r} is unknown{hint}; known: {', '.join(table)}")
    return make(table[kind], rest, key)  # type: ignore[arg-type]  # the factories of these tables are classes


def to_dict(part: Any) -> dict[str, Any]:
    """Return a scenario, or a part of it, as the keys of a TOML or JSON document, without the settings that are left open."""
    return {key: _value(key, value) for key, value in _settings(part) if value is not None}


def _settings(part: Any) -> Iterator[tuple[str, Any]]:
    yield from ((field.name, getattr(part, field.name)) for field in fields(part))


def _value(key: str, value: Any) -> Any:
    if is_dataclass(value):
        return {**({"kind": _kind(key, value)} if key in KINDS else {}), **to_dict(value)}
    if isinstance(value, tuple):
        return [_value(key, item) for item in value]
    return value


def _kind(key: str, value: Any) -> str:
    if not isinstance(value, KINDS[key].kind):
        raise ScenarioError(f"{key}: {type(value).__name__} is none of the {KINDS[key].point}")
    return KINDS[key].own(type(value))


def to_toml(scenario: Scenario) -> str:
    """Return the scenario as a TOML document that explains every key."""
    simple, tables = [], []
    for key, value in _settings(scenario):
        if is_dataclass(value):
            tables.append("\n".join(_table(key, value)))
        elif key == "fault":
            tables += ["\n".join(_table(key, fault, several=True)) for fault in value]
        elif value not in ("", (), None):
            simple.append(_explained(type(scenario), key, value))
    if not scenario.fault:
        tables.append(
            "# [[fault]]  # something wrong with robot or log: `idbench list` has the kinds\n# kind = ...\n# size = ..."
        )
    tables.sort(key=lambda table: len(table) > LONGEST)  # waypoints come last: the rest is what one changes
    return "\n\n".join(["\n".join(simple), *tables]) + "\n"


def _table(key: str, part: Any, *, several: bool = False) -> Iterator[str]:
    yield f"# {description(Scenario, key)}."
    yield f"[[{key}]]" if several else f"[{key}]"
    if key in KINDS:
        yield f"kind = {_kind(key, part)!r}  # {', '.join(KINDS[key])}".replace("'", '"')
    for name, value in _settings(part):
        if value is None:
            yield f"# {name} = ...  # {description(type(part), name)}"
        else:
            yield _explained(type(part), name, value)


def _explained(cls: type, key: str, value: Any) -> str:
    """Return `key = value  # what it is (its range)`."""
    one = for_all_joints(cls, key) and len(value) == 1
    text = f"{key} = {_written(value[0] if one else value)}"
    allowed = limits(cls, key)
    comment = f"# {description(cls, key)}" + (f" ({allowed})" if allowed else "")
    return f"{text}  {comment}" if len(text) < LONG else f"{comment}\n{text}"


def _written(value: Any) -> str:
    """Return a value as TOML: a list of numbers in one line, a list of lists or a long list in many."""
    if not isinstance(value, tuple):
        return tomli_w.dumps({"x": value}).removeprefix("x = ").rstrip("\n")
    items = [_written(item) for item in value]
    short = f"[{', '.join(items)}]"
    many = "".join(f"    {item},\n" for item in items)
    return short if len(short) < LONG and "[" not in short[1:] else f"[\n{many}]"
