"""Options of `idbench scenario`."""

from dataclasses import dataclass
from typing import final

import tyro

from experiments.cli.app import command
from experiments.cli.command import Command
from experiments.option_types import File, Scenario


@command("scenario")
@final
@dataclass(frozen=True)
class WriteScenario(Command, action="scenario:write"):
    """Write a scenario out to start from, every setting explained; without a name, list those that ship."""

    name: tyro.conf.Positional[Scenario] = None
    """Name of a scenario, or a file."""
    out: File = None
    """File (TOML) to write; printed if none is given."""
    force: bool = False
    """Replace a file that is there already."""
