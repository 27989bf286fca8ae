"""Options of the commands that show what there is."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, final

import tyro

from experiments.cli.app import command
from experiments.cli.command import Command
from experiments.option_types import File, Json


@command("list")
@final
@dataclass(frozen=True)
class List(Command, action="list:list_plugins"):
    """List the plug-ins: what can be combined, one line each."""

    json: Json = False
    """Print it as JSON instead."""


@command("view")
@final
@dataclass(frozen=True)
class View(Command, action="view:view"):
    """Open the recording of a results folder in the rerun viewer; those of several laid over each other, to be compared."""

    folders: tyro.conf.Positional[Annotated[tuple[Path, ...], tyro.conf.arg(metavar="DIR|FILE")]] = ()
    """Results folders, or a recording (.rrd); the latest of runs/ if none is named."""
    tab: str = ""
    """What is in front: overview, friction, drive, filters, noise, excitation, parameters, iterations,
    torques, compare, study or table2, if it has it."""
    save: File = None
    """Write the recording and its layers to one file (.rrd) instead, to be taken elsewhere."""
    force: bool = False
    """Replace a file that is there already."""
