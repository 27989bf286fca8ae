"""How a robot is mounted, as options say it."""

from experiments.cli.options import MountingOptions
from sim.robot.mounting import Mounting, locked


def mounting_of(options: MountingOptions) -> Mounting:
    """Return the mounting; raise RobotError if a lock is none."""
    return Mounting(options.joints, locked(options.lock), options.gravity)
