"""Options of the commands that show what there is."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, final

import tyro

from idbench.experiments.cli.app import command
from idbench.experiments.cli.command import Command
from idbench.experiments.option_types import File


@command("view")
@final
@dataclass(frozen=True)
class View(Command, action="view:view"):
    """Open the recording of a results folder in the rerun viewer, or overlay those of several."""

    folders: tyro.conf.Positional[Annotated[tuple[Path, ...], tyro.conf.arg(metavar="DIR|FILE")]] = ()
    """Results folders, or a recording (.rrd). Default: the latest of runs/."""
    tab: str = ""
    """Tab to show first: overview, friction, drive, filters, noise, excitation, parameters, iterations, torques, compare, study
    or table2."""
    save: File = None
    """Write the recording and its layers to one file (.rrd) instead of opening them."""
    force: bool = False
    """Replace an existing file."""
