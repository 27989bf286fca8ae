"""How logs are read, and how their robot is mounted."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, final

import tyro

from idbench.experiments.option_types import Each, File, Texts, Vector

if TYPE_CHECKING:
    from idbench.sim.robot.mounting import Mounting

Joints = Annotated[tuple[str, ...], tyro.conf.arg(metavar="JOINT")]


@final
@dataclass(frozen=True)
class ColumnOptions:
    """What the columns of a log are, unless a log.toml beside it states it."""

    layout: File = None
    """Another log.toml that describes the columns. `idbench log FILE --write` makes one."""
    columns: Texts = ()
    """Names of columns: t=time q=position_* tau=effort_* (* stands for numbers or names of joints; or a list with commas)."""
    units: Texts = ()
    """Units: t=ms q=deg tau=mNm, or tau=A with --gain."""
    rows: Texts = ()
    """Use only rows in which columns have these values: episode_index=3."""
    gain: Each = ()
    """Torque per logged unit (N m/A): one for all joints, or one each."""
    resample: bool = False
    """Make times uniform: remove repeated rows, use a steady clock where stamps jitter, interpolate missing samples, split at
    gaps, use logged velocities where they are more accurate. Every step is reported."""

    @property
    def stated(self) -> bool:
        """Whether they say anything of columns."""
        return bool(self.layout or self.columns or self.units or self.gain or self.rows)


@final
@dataclass(frozen=True)
class MountingOptions:
    """How the robot is mounted, and which joints the log contains."""

    joints: Joints = ()
    """Joints of the log, in the order of its columns, if the robot has more (grippers, mobile bases)."""
    lock: Annotated[tuple[str, ...], tyro.conf.arg(metavar="JOINT=VALUE")] = ()
    """Joints that do not move, and their positions [rad, m]."""
    coupling: Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME=JOINT+JOINT")] = ()
    """Drives whose motor turns with several joints, with rotor and friction of their own: motor6=joint_5+joint_6, or with
    factors, m2=a-0.5*b. In an MJCF file these are fixed tendons."""
    gravity: Vector = None
    """Gravity in the frame of the robot's base [m/s^2], for a base on a wall or ceiling. Default: the file's."""

    @property
    def mounting(self) -> "Mounting":
        """The mounting; RobotError if a lock or a coupling is none."""
        from idbench.sim.robot.mounting import Mounting, coupled, locked

        return Mounting(self.joints, locked(self.lock), self.gravity, coupled(self.coupling))
