"""How a robot is mounted, as options say it."""

from experiments.cli.options import MountingOptions
from sim.robot.mounting import Mounting, coupled, locked


def mounting_of(options: MountingOptions) -> Mounting:
    """Return the mounting; raise RobotError if a lock or a coupling is none."""
    return Mounting(options.joints, locked(options.lock), options.gravity, coupled(options.coupling))
