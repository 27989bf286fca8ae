"""Types of requests, with what a value is called where it is typed; no library of command lines is needed for them."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal


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
Seconds = Annotated[float | None, Word("SECONDS")]
Real = Annotated[float | None, Word("FLOAT")]
Count = Annotated[int | None, Word("N")]
Robot = Annotated[str | None, Word("NAME|FILE", file="robot")]
ThisRobot = Annotated[str, Word(positional=True, file="robot")]
Scenario = Annotated[str | None, Word("SCENARIO", file="name")]
ThisScenario = Annotated[str | None, Word("SCENARIO", positional=True, file="name")]
Url = Annotated[str | None, Word("URL")]
Delay = Annotated[str | None, Word("SECONDS|estimate|joints")]
Percent = Annotated[str | None, Word("PERCENT")]
Meaning = Literal["held", "instantaneous", "averaged"]
Torque = Annotated[Meaning | None, Word("held|instantaneous|averaged")]
Start = Literal["least-squares", "file"]
"""Where estimators begin that simulate or filter: at the least-squares estimate, or at the parameters of the robot's file."""
Way = Literal["all", "together", "fixed", "apart", "difference"]
Logs = Annotated[tuple[Path, ...], Word(positional=True, file="log")]
Log = Annotated[Path, Word(positional=True, file="log")]
Files = Annotated[tuple[Path, ...], Word("FILE", file="log")]
Each = Annotated[tuple[float, ...], Word("FLOAT")]
Window = Annotated[tuple[float, float] | None, Word("FROM TO")]
Vector = Annotated[tuple[float, float, float] | None, Word("X Y Z")]
Six = Annotated[tuple[float, float, float, float, float, float] | None, Word("XX YY ZZ XY XZ YZ")]
Scenarios = Annotated[tuple[str, ...], Word("SCENARIO", file="name")]
Texts = Annotated[tuple[str, ...], Word("NAME=VALUE")]
Weights = Annotated[tuple[str, ...], Word("NAME=WEIGHT")]
Names = Annotated[tuple[str, ...], Word("NAME")]
Letters = Annotated[tuple[str, ...], Word("LETTER")]
Joints = Annotated[tuple[str, ...], Word("JOINT")]
Laws = Annotated[tuple[str, ...], Word("[JOINT=]LAW+LAW")]
Verbose = Annotated[bool, Word(flag=True, short="-v")]
"""Whether details are printed, too."""

Json = Annotated[bool, Word(flag=True)]
"""Whether standard output is for a program: what summary.json has, and warnings; text goes to the error stream."""
