"""Types of options that several commands have, with what their help calls a value."""

from pathlib import Path
from typing import Annotated, Literal

import tyro


def _named(metavar: str) -> object:
    return tyro.conf.arg(metavar=metavar, help_behavior_hint="")


File = Annotated[Path | None, _named("FILE")]
Files = Annotated[tuple[Path, ...], _named("FILE")]
Folder = Annotated[Path | None, _named("DIR")]
Hertz = Annotated[float | None, _named("HZ")]
Seconds = Annotated[float | None, _named("SECONDS")]
Real = Annotated[float | None, _named("FLOAT")]
Each = Annotated[tuple[float, ...], _named("FLOAT")]
Count = Annotated[int | None, _named("N")]
Window = Annotated[tuple[float, float] | None, _named("FROM TO")]
Vector = Annotated[tuple[float, float, float] | None, _named("X Y Z")]
Robot = Annotated[str | None, _named("NAME|FILE")]
Scenario = Annotated[str | None, _named("SCENARIO")]
Scenarios = Annotated[tuple[str, ...], _named("SCENARIO")]
Texts = Annotated[tuple[str, ...], _named("NAME=VALUE")]
Url = Annotated[str | None, _named("URL")]
Delay = Annotated[str | None, _named("SECONDS|estimate")]
Meaning = Literal["held", "instantaneous", "averaged"]
Torque = Annotated[Meaning | None, _named("held|instantaneous|averaged")]
Json = Annotated[bool, tyro.conf.FlagCreatePairsOff]
"""Whether standard output is for a program: what summary.json has, and warnings; text goes to the error stream."""
