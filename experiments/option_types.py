"""Types of options that several commands have, with what their help calls a value."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro
from tyro.constructors import PrimitiveConstructorSpec


def _named(metavar: str) -> Any:
    return tyro.conf.arg(metavar=metavar, help_behavior_hint="")


def _one(metavar: str, made: Callable[[str], Any], *known: str) -> PrimitiveConstructorSpec[Any]:
    """Return how one word becomes a value: otherwise the word None would mean that an option is not given."""
    return PrimitiveConstructorSpec(
        nargs=1,
        metavar=metavar,
        instance_from_str=lambda words: made(words[0]),
        is_instance=lambda _: True,
        str_from_instance=lambda value: [] if value is None else [str(value)],
        choices=known or None,
    )


Unhinted = tyro.conf.arg(help_behavior_hint="")
File = Annotated[Path | None, _one("FILE", Path), Unhinted]
Folder = Annotated[Path | None, _one("DIR", Path), Unhinted]
Hertz = Annotated[float | None, _one("HZ", float), Unhinted]
Seconds = Annotated[float | None, _one("SECONDS", float), Unhinted]
Real = Annotated[float | None, _one("FLOAT", float), Unhinted]
Count = Annotated[int | None, _one("N", int), Unhinted]
Robot = Annotated[str | None, _one("NAME|FILE", str), Unhinted]
Scenario = Annotated[str | None, _one("SCENARIO", str), Unhinted]
Url = Annotated[str | None, _one("URL", str), Unhinted]
Delay = Annotated[str | None, _one("SECONDS|estimate", str), Unhinted]
Meaning = Literal["held", "instantaneous", "averaged"]
Torque = Annotated[Meaning | None, _one("held|instantaneous|averaged", str, "held", "instantaneous", "averaged"), Unhinted]
Files = Annotated[tuple[Path, ...], _named("FILE")]
Each = Annotated[tuple[float, ...], _named("FLOAT")]
Window = Annotated[tuple[float, float] | None, _named("FROM TO")]
Vector = Annotated[tuple[float, float, float] | None, _named("X Y Z")]
Scenarios = Annotated[tuple[str, ...], _named("SCENARIO")]
Texts = Annotated[tuple[str, ...], _named("NAME=VALUE")]
Json = Annotated[bool, tyro.conf.FlagCreatePairsOff]
"""Whether standard output is for a program: what summary.json has, and warnings; text goes to the error stream."""
