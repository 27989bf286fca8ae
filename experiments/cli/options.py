"""Options that several commands have."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, final

import tyro

from experiments.identification.parameters import Parameters
from experiments.recording.audience import Watching

File = Annotated[Path | None, tyro.conf.arg(metavar="FILE", help_behavior_hint="")]
Files = Annotated[tuple[Path, ...], tyro.conf.arg(metavar="FILE", help_behavior_hint="")]
Hertz = Annotated[float | None, tyro.conf.arg(metavar="HZ", help_behavior_hint="")]
Folder = Annotated[Path | None, tyro.conf.arg(metavar="DIR", help_behavior_hint="")]
Scenario = Annotated[str | None, tyro.conf.arg(metavar="SCENARIO", help_behavior_hint="")]
Robot = Annotated[str | None, tyro.conf.arg(metavar="NAME|FILE", help_behavior_hint="")]
Count = Annotated[int | None, tyro.conf.arg(metavar="INT", help_behavior_hint="")]
Number = Annotated[int | None, tyro.conf.arg(metavar="N", help_behavior_hint="")]
Window = Annotated[tuple[float, float] | None, tyro.conf.arg(metavar="FROM TO", help_behavior_hint="")]

Loops = Annotated[tuple[str, ...], tyro.conf.arg(metavar="SCENARIO", help_behavior_hint="")]

Json = Annotated[bool, tyro.conf.FlagCreatePairsOff]
"""Whether standard output is for a program: what summary.json has, and warnings; text goes to the error stream."""

Meaning = Literal["held", "instantaneous", "averaged"]
Torque = Annotated[Meaning | None, tyro.conf.arg(metavar="held|instantaneous|averaged", help_behavior_hint="")]
Delay = Annotated[str | None, tyro.conf.arg(metavar="SECONDS|estimate", help_behavior_hint="")]

Watched = Annotated[Watching, tyro.conf.OmitArgPrefixes, tyro.conf.OmitSubcommandPrefixes]
"""How a command is watched."""

Asked = Annotated[Parameters, tyro.conf.OmitArgPrefixes]


Texts = Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME=VALUE", help_behavior_hint="")]


@final
@dataclass(frozen=True)
class ColumnOptions:
    """What the columns of a log are, where no log.toml beside it says so."""

    layout: File = None
    """A log.toml that stands elsewhere: what the columns are. `idbench log FILE --write` makes one."""
    columns: Texts = ()
    """Names of columns: t=time q=position_* tau=effort_* (a * stands for numbers or names of joints; or list them with
    commas)."""
    units: Texts = ()
    """Units: t=ms q=deg tau=mNm, or tau=A with --gain."""
    rows: Texts = ()
    """Only rows in which columns have these values: episode_index=3."""
    gain: Annotated[tuple[float, ...], tyro.conf.arg(metavar="FLOAT")] = ()
    """Torque over what is logged, in the unit of tau (N m/A): one for all joints, or one each."""
    resample: bool = False
    """Make times uniform: leave repeated rows out, take a steady clock where stamps jitter, fill drops, cut at gaps, use
    logged velocities where they know better. What was done is said."""

    @property
    def stated(self) -> bool:
        """Whether they say anything of columns."""
        return bool(self.layout or self.columns or self.units or self.gain or self.rows)


Reading = Annotated[ColumnOptions, tyro.conf.OmitArgPrefixes]


@final
@dataclass(frozen=True)
class MountingOptions:
    """How the robot is mounted, and which of its joints the log has."""

    joints: Annotated[tuple[str, ...], tyro.conf.arg(metavar="JOINT")] = ()
    """Joints of the log, in the order of its columns, where the robot has more: grippers, mobile bases."""
    lock: Annotated[tuple[str, ...], tyro.conf.arg(metavar="JOINT=VALUE")] = ()
    """Joints that do not move, and where they are held [rad, m]."""
    coupling: Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME=JOINT+JOINT")] = ()
    """Drives whose motor turns with several joints, each with a rotor and frictions of its own: motor6=joint_5+joint_6, or with
    factors, m2=a-0.5*b. Those of an MJCF file are its fixed tendons."""
    gravity: Annotated[tuple[float, float, float] | None, tyro.conf.arg(metavar="X Y Z", help_behavior_hint="")] = None
    """Gravity in the frame of the robot's base [m/s^2], for one on a wall or a ceiling; the file's by default."""


Mounted = Annotated[MountingOptions, tyro.conf.OmitArgPrefixes]
