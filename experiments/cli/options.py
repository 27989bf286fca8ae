"""Options that several commands have."""

from pathlib import Path
from typing import Annotated, Literal

import tyro

from experiments.identification.parameters import Parameters
from experiments.recording.audience import Watching

File = Annotated[Path | None, tyro.conf.arg(metavar="FILE", help_behavior_hint="")]
Folder = Annotated[Path | None, tyro.conf.arg(metavar="DIR", help_behavior_hint="")]
Scenario = Annotated[str | None, tyro.conf.arg(metavar="SCENARIO", help_behavior_hint="")]
Robot = Annotated[str | None, tyro.conf.arg(metavar="NAME|FILE", help_behavior_hint="")]
Count = Annotated[int | None, tyro.conf.arg(metavar="INT", help_behavior_hint="")]
Number = Annotated[int | None, tyro.conf.arg(metavar="N", help_behavior_hint="")]
Window = Annotated[tuple[float, float] | None, tyro.conf.arg(metavar="FROM TO", help_behavior_hint="")]

Json = Annotated[bool, tyro.conf.FlagCreatePairsOff]
"""Whether standard output is for a program: what summary.json has, and warnings; text goes to the error stream."""

Meaning = Literal["held", "instantaneous", "averaged"]
Torque = Annotated[Meaning | None, tyro.conf.arg(metavar="held|instantaneous|averaged", help_behavior_hint="")]
Delay = Annotated[str | None, tyro.conf.arg(metavar="SECONDS|estimate", help_behavior_hint="")]

Watched = Annotated[Watching, tyro.conf.OmitArgPrefixes, tyro.conf.OmitSubcommandPrefixes]
"""How a command is watched."""

Asked = Annotated[Parameters, tyro.conf.OmitArgPrefixes]
