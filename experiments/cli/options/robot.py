"""Options of `idbench robot`."""

from dataclasses import dataclass
from typing import final

import tyro

from idbench.experiments.cli.app import command
from idbench.experiments.cli.command import Command
from idbench.experiments.cli.options.shared import Asked, Mounted
from idbench.experiments.identification.parameters import Parameters
from idbench.experiments.identification.read_options import MountingOptions
from idbench.experiments.option_types import Json


@command("robot")
@final
@dataclass(frozen=True)
class DescribeRobot(Command, action="robot:describe"):
    """Show what is identifiable: joints, base parameters, and a torque budget."""

    name: tyro.conf.Positional[str]
    """Name of a shipped robot, or its file: MJCF, URDF, or a table of Denavit-Hartenberg parameters (.toml)."""
    json: Json = False
    """Print joints and parameters as JSON; human-readable text goes to the error stream."""
    parameters: Asked = Parameters()  # noqa: RUF009  # frozen
    """Which parameters are identified."""
    mounting: Mounted = MountingOptions()  # noqa: RUF009  # frozen
    """How the robot is mounted."""
