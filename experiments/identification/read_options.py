"""How logs are read, and how their robot is mounted."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, final

import tyro

from experiments.option_types import Each, File, Texts, Vector

if TYPE_CHECKING:
    from sim.robot.mounting import Mounting

Joints = Annotated[tuple[str, ...], tyro.conf.arg(metavar="JOINT")]


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
    gain: Each = ()
    """Torque over what is logged, in the unit of tau (N m/A): one for all joints, or one each."""
    resample: bool = False
    """Make times uniform: leave repeated rows out, take a steady clock where stamps jitter, fill drops, cut at gaps, use
    logged velocities where they know better. What was done is said."""

    @property
    def stated(self) -> bool:
        """Whether they say anything of columns."""
        return bool(self.layout or self.columns or self.units or self.gain or self.rows)


@final
@dataclass(frozen=True)
class MountingOptions:
    """How the robot is mounted, and which of its joints the log has."""

    joints: Joints = ()
    """Joints of the log, in the order of its columns, where the robot has more: grippers, mobile bases."""
    lock: Annotated[tuple[str, ...], tyro.conf.arg(metavar="JOINT=VALUE")] = ()
    """Joints that do not move, and where they are held [rad, m]."""
    coupling: Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME=JOINT+JOINT")] = ()
    """Drives whose motor turns with several joints, each with a rotor and frictions of its own: motor6=joint_5+joint_6, or with
    factors, m2=a-0.5*b. Those of an MJCF file are its fixed tendons."""
    gravity: Vector = None
    """Gravity in the frame of the robot's base [m/s^2], for one on a wall or a ceiling; the file's by default."""

    @property
    def mounting(self) -> "Mounting":
        """The mounting; RobotError if a lock or a coupling is none."""
        from sim.robot.mounting import Mounting, coupled, locked

        return Mounting(self.joints, locked(self.lock), self.gravity, coupled(self.coupling))
