"""Options that several commands have."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, final

import tyro

from experiments.audience import Watching

File = Annotated[Path | None, tyro.conf.arg(metavar="FILE")]
Folder = Annotated[Path | None, tyro.conf.arg(metavar="DIR")]
Scenario = Annotated[str | None, tyro.conf.arg(metavar="SCENARIO")]
Robot = Annotated[str | None, tyro.conf.arg(metavar="NAME|FILE")]
Count = Annotated[int | None, tyro.conf.arg(metavar="INT")]
Number = Annotated[int | None, tyro.conf.arg(metavar="N")]
Window = Annotated[tuple[float, float] | None, tyro.conf.arg(metavar="FROM TO")]

Meaning = Literal["held", "instantaneous", "averaged"]
Torque = Annotated[Meaning | None, tyro.conf.arg(metavar="held|instantaneous|averaged")]
Delay = Annotated[str | None, tyro.conf.arg(metavar="SECONDS|estimate")]

Watched = Annotated[Watching, tyro.conf.OmitArgPrefixes, tyro.conf.OmitSubcommandPrefixes]
"""How a command is watched."""

Names = Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME")]


@final
@dataclass(frozen=True)
class Parameters:
    """Which parameters of a robot are asked for."""

    armature: Literal["file", "all"] = "file"
    """Which joints have the inertia of a rotor: those to which the robot's file gives one, or all."""
    add: Names = ()
    """Laws of friction beside viscous and Coulomb friction, such as offset, a constant torque of each joint."""
    without: Names = ()
    """Parameters to leave out, as if they were zero."""


Asked = Annotated[Parameters, tyro.conf.OmitArgPrefixes]
