"""What the firmware of a scenario's servos is known to do, as servo.toml."""

import tomli_w

from sim.drives import ServoDrive
from sim.robot.robot import Robot
from sim.settings import per_joint


def servo_toml(drive: ServoDrive, robot: Robot) -> str:
    """Return what an owner knows of the servos of a scenario: gains, supply, largest duty, counts."""
    counts = {"counts": drive.counts} if drive.counts else {}
    kp = per_joint(drive.kp, robot.n, "drive.kp").tolist()
    stated = {"gain": drive.gain, "supply": drive.supply, "duty_limit": drive.duty_limit, "kp": kp[0], **counts}
    others = {joint: {"kp": x} for joint, x in zip(robot.joints, kp, strict=True) if x != kp[0]}
    return tomli_w.dumps({**stated, **({"joints": others} if others else {})})
