"""What the owner of a scenario's servos knows of them."""

from pathlib import Path

import numpy as np
import tomli_w

from idbench.identify.servo import Servo
from idbench.sim.drives import ServoDrive
from idbench.sim.engine.run import Run
from idbench.sim.robot.robot import Robot
from idbench.sim.settings import per_joint

EXACT = 2**24
"""Counts a turn that stand for a firmware without rounding."""


def known_servos(drive: ServoDrive, n: int) -> list[Servo]:
    """Return gain, supply, largest duty and counts of the servos of n joints."""
    kp = per_joint(drive.kp, n, "drive.kp").tolist()
    return [Servo(drive.gain, x, drive.supply, drive.duty_limit, drive.counts or EXACT) for x in kp]


def servo_toml(drive: ServoDrive, robot: Robot) -> str:
    """Return what is known of the servos of a robot as servo.toml."""
    first, *others = known_servos(drive, robot.n)
    differing = {joint: {"kp": servo.kp} for joint, servo in zip(robot.joints[1:], others, strict=True) if servo.kp != first.kp}
    return tomli_w.dumps({**vars(first), **({"joints": differing} if differing else {})})


def write_commands(run: Run, robot: Robot, path: Path) -> None:
    """Write commands as they can be played on a robot: t [s], and angles of the robot's file [rad]."""
    header = ",".join(["t", *(f"command_{joint}" for joint in robot.joints)])
    np.savetxt(path, np.c_[run.log.t, run.command[0]], "%.6g", ",", header=header, comments="")
