"""Options of `idbench benchmark`."""

from dataclasses import dataclass
from pathlib import Path
from typing import final

import tyro

from idbench.experiments.cli.app import command
from idbench.experiments.cli.command import Command
from idbench.experiments.option_types import Count, Folder, Json, Url


@command("benchmark")
@final
@dataclass(frozen=True)
class Benchmark(Command, action="benchmark:benchmark"):
    """Identify sets of real logs, and judge each on logs that it was not fitted to. Without a name: list the sets."""

    sets: tyro.conf.Positional[tuple[Path, ...]] = ()
    """Folders with a benchmark.toml and its data; `idbench new set NAME` writes a definition that ships."""
    out: Folder = None
    """Folder of the results. Rows that it has already, of the same definition, files and version, are not made again. Torques
    that other tools have put there (predicted-TOOL.npz) are judged. Default: runs/benchmark."""
    workers: Count = None
    """Run in this number of processes (extra `cluster`)."""
    scheduler: Url = None
    """Run on a Dask scheduler, such as tcp://host:8786, whose workers see the same files (extra `cluster`)."""
    force: bool = False
    """Make all rows again, and replace files that idbench did not write."""
    json: Json = False
    """Print summary and warnings as JSON; human-readable text goes to the error stream."""
