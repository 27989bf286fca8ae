"""Options of `idbench scenario`."""

from dataclasses import dataclass
from typing import final

import tyro

from idbench.experiments.cli.app import command
from idbench.experiments.cli.command import Command
from idbench.experiments.option_types import File, Scenario


@command("scenario")
@final
@dataclass(frozen=True)
class WriteScenario(Command, action="scenario:write"):
    """Write a scenario to a file, with every setting explained. Without a name: list the shipped scenarios."""

    name: tyro.conf.Positional[Scenario] = None
    """Name of a scenario, or a file."""
    out: File = None
    """File (TOML) to write. Default: print it."""
    force: bool = False
    """Replace an existing file."""
