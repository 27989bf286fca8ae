"""Commands that show what there is: their options, and the functions that do the work."""

from dataclasses import dataclass
from pathlib import Path
from typing import final

import tyro

from experiments.cli.app import APP
from experiments.cli.interruption import importing
from experiments.cli.options import File


@APP.command(name="list")
@final
@dataclass(frozen=True)
class List:
    """List the plug-ins: what can be combined, one line each."""

    def __call__(self) -> None:
        """Run it."""
        with importing():
            from experiments.cli.plugins import list_plugins
        list_plugins()


@APP.command(name="view")
@final
@dataclass(frozen=True)
class View:
    """Open the recording of a results folder, with all its layers, in the rerun viewer."""

    folder: tyro.conf.Positional[Path]
    """Results folder, or a recording (.rrd)."""
    tab: str = ""
    """What is in front: overview, friction, drive, filters, noise, excitation, parameters, study or table2, if it has it."""
    save: File = None
    """Write the recording and its layers to one file (.rrd) instead, to be taken elsewhere."""

    def __call__(self) -> None:
        """Run it."""
        with importing():
            from experiments.cli.viewer import view
        view(self)
