"""Options of `idbench robot`."""

from dataclasses import dataclass
from typing import final

import tyro

from experiments.cli.app import command
from experiments.cli.command import Command
from experiments.cli.options.shared import Asked, Mounted
from experiments.identification.parameters import Parameters
from experiments.identification.read_options import MountingOptions
from experiments.option_types import Json


@command("robot")
@final
@dataclass(frozen=True)
class DescribeRobot(Command, action="robot:describe"):
    """Show what can be identified of a robot: its joints, its base parameters, what its torques are made of."""

    name: tyro.conf.Positional[str]
    """Name of a robot that ships, or a file that describes it: MJCF, URDF, or a table of DH parameters (.toml)."""
    json: Json = False
    """Print joints and parameters as JSON; what is for people goes to the error stream."""
    parameters: Asked = Parameters()  # noqa: RUF009  # frozen
    """Which parameters are asked for."""
    mounting: Mounted = MountingOptions()  # noqa: RUF009  # frozen
    """How the robot is mounted."""
