"""Commands that show what there is: their options, and the functions that do the work."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, final

import tyro

from experiments.cli.app import APP
from experiments.cli.interruption import importing
from experiments.cli.options import File, Json


@APP.command(name="list")
@final
@dataclass(frozen=True)
class List:
    """List the plug-ins: what can be combined, one line each."""

    json: Json = False
    """Print it as JSON instead."""

    def __call__(self) -> None:
        """Run it."""
        with importing():
            from experiments.cli.plugins import list_plugins
        list_plugins(machine=self.json)


@APP.command(name="view")
@final
@dataclass(frozen=True)
class View:
    """Open the recording of a results folder in the rerun viewer; those of several laid over each other, to be compared."""

    folders: tyro.conf.Positional[Annotated[tuple[Path, ...], tyro.conf.arg(metavar="DIR|FILE")]] = ()
    """Results folders, or a recording (.rrd); the latest of runs/ if none is named."""
    tab: str = ""
    """What is in front: overview, friction, drive, filters, noise, excitation, parameters, iterations,
    torques, compare, study or table2, if it has it."""
    save: File = None
    """Write the recording and its layers to one file (.rrd) instead, to be taken elsewhere."""

    def __call__(self) -> None:
        """Run it."""
        with importing():
            from experiments.cli.viewer import view
        view(self)
