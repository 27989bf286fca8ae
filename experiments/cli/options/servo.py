"""Options of `idbench servo`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, final

import tyro

from idbench.experiments.cli.app import command
from idbench.experiments.cli.command import Command
from idbench.experiments.cli.options.shared import Mounted, RecordedOptions
from idbench.experiments.identification.read_options import MountingOptions
from idbench.experiments.option_types import File, Files, Robot, Texts

Law = Annotated[str, tyro.conf.arg(metavar="LAW")]
Letters = Annotated[tuple[str, ...], tyro.conf.arg(metavar="LETTER")]


@command("servo")
@final
@dataclass(frozen=True)
class IdentifyServo(RecordedOptions, Command, action="servo:servo"):
    """Identify position-controlled joints (Feetech, Dynamixel) from commands and positions alone; write them for MuJoCo."""

    log: tyro.conf.Positional[tuple[Path, ...]] = ()
    """Logs of commands and positions: columns t, q1, ..., command1, ... in SI units; on1, ..., voltage1, ... if logged."""
    robot: Robot = None
    """Name of a shipped robot, or its file: MJCF or URDF. Its links, a known mass included, set the scale of all torques."""
    servo: File = None
    """servo.toml: model = "STS3215" or gain = 0.166, then kp, supply, duty_limit, counts; [joints.NAME] and [logs."FILE"] for
    what differs."""
    friction: Law = "load"
    """Friction law: coulomb, stribeck, load, load-stribeck, directional, quadratic, gear; auto compares them, and takes the
    simplest that no other predicts significantly better."""
    find: Letters = ()
    """Further parameters to be found: lead, dead_band, backlash, Mg, Fo."""
    hold: Texts = ()
    """Known parameters, of all joints or of one: Ia=0.02 wrist_roll.a=0.5 (N m/V)."""
    columns: Texts = ()
    """Names of columns: q=position_* command=goal_* on=torque_enable (* stands for numbers or names of joints)."""
    units: Texts = ()
    """Units: t=ms q=deg command=deg."""
    mounting: Mounted = MountingOptions()  # noqa: RUF009  # frozen
    """How the robot is mounted."""
    validate: Files = ()
    """Held-out logs, simulated from their commands alone. Default: the last log, where there are several."""
    write_mjcf: File = None
    """Write the robot's MJCF file with these servos as `dcmotor` actuators, and measure it on a log in plain MuJoCo."""
    write: File = None
    """Write the servos as a Python file (class `Servo`), for your own simulator."""
    position: bool = False
    """Write `position` actuators instead, for older versions of MuJoCo."""
