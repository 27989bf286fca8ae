"""Types of requests, with what a value is called where it is typed; no library of command lines is needed for them."""

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints


@dataclass(frozen=True)
class Word:
    """How a value is typed."""

    metavar: str = ""
    """What it is called."""
    option: str = ""
    """Name of its option, where that is not the field's."""
    positional: bool = False
    """Whether it is typed without a name."""
    flag: bool = False
    """Whether it is switched on alone, never off."""
    short: str = ""
    """Another name of its option, such as -v."""
    file: Literal["", "file", "log", "robot", "name"] = ""
    """Which kind of file it names (a log, or the folder of a run; a robot that ships, or its file; the name of what ships, or a
    file), if it does: what a file names is looked for beside that file."""


File = Annotated[Path | None, Word("FILE", file="file")]
Folder = Annotated[Path | None, Word("DIR")]
Hertz = Annotated[float | None, Word("HZ")]
Real = Annotated[float | None, Word("FLOAT")]
Count = Annotated[int | None, Word("N")]
Robot = Annotated[str | None, Word("NAME|FILE", file="robot")]
ThisRobot = Annotated[str, Word(positional=True, file="robot")]
Scenario = Annotated[str | None, Word("SCENARIO", file="name")]
ThisScenario = Annotated[str | None, Word("SCENARIO", positional=True, file="name")]
Url = Annotated[str | None, Word("URL")]
Delay = Annotated[str | None, Word("SECONDS|estimate|joints")]
Meaning = Literal["held", "instantaneous", "averaged"]
Torque = Annotated[Meaning | None, Word("held|instantaneous|averaged")]
Start = Literal["least-squares", "file"]
"""Where estimators begin that simulate or filter: at the least-squares estimate, or at the parameters of the robot's file."""
Logs = Annotated[tuple[Path, ...], Word(positional=True, file="log")]
Log = Annotated[Path, Word(positional=True, file="log")]
Files = Annotated[tuple[Path, ...], Word("FILE", file="log")]
Each = Annotated[tuple[float, ...], Word("FLOAT")]
Window = Annotated[tuple[float, float] | None, Word("FROM TO")]
Vector = Annotated[tuple[float, float, float] | None, Word("X Y Z")]
Texts = Annotated[tuple[str, ...], Word("NAME=VALUE")]
Names = Annotated[tuple[str, ...], Word("NAME")]
Joints = Annotated[tuple[str, ...], Word("JOINT")]
Verbose = Annotated[bool, Word(flag=True, short="-v")]
"""Whether details are printed, too."""

Json = Annotated[bool, Word(flag=True)]
"""Whether standard output is for a program: what summary.json has, and warnings; text goes to the error stream."""

Place = tuple[str, ...]
"""Where a key of a request is: the names of the group and the field."""


def plain_of(hint: Any) -> Any:
    """Type of a value, without how it is typed."""
    return get_args(hint)[0] if get_origin(hint) is Annotated else hint


def word_of(hint: Any) -> Word:
    """How a value of a type is typed."""
    return next((mark for mark in getattr(hint, "__metadata__", ()) if isinstance(mark, Word)), Word())


def request_keys(request: type) -> dict[str, tuple[Place, Any]]:
    """Keys of a request, those of its groups among them: place and type of each."""
    found, hints = dict[str, tuple[Place, Any]](), get_type_hints(request, include_extras=True)
    for name in (each.name for each in fields(request)):
        if hasattr(inner := plain_of(hints[name]), "__dataclass_fields__"):
            found |= {key: ((name, *place), hint) for key, (place, hint) in request_keys(inner).items()}
        else:
            found[name] = (name,), hints[name]
    return found
