"""Options of `idbench study`."""

from dataclasses import dataclass
from typing import Annotated, final

import tyro

from idbench.experiments.cli.app import command
from idbench.experiments.cli.command import Command
from idbench.experiments.cli.options.shared import Watched
from idbench.experiments.option_types import Count, Folder, Json, Url
from idbench.experiments.recording.audience import Watching


@command("study")
@final
@dataclass(frozen=True)
class Study(Command, action="study:study"):
    """Run a study: simulate a scenario over a grid and many seeds, and identify each run. Without a name: list the studies."""

    study: tyro.conf.Positional[Annotated[str | None, tyro.conf.arg(metavar="STUDY", help_behavior_hint="")]] = None
    """Name of a shipped study, or its file (TOML)."""
    out: Folder = None
    """Folder of the study. Default: runs/<study>."""
    resume: Folder = None
    """Folder of an interrupted study: run what is missing, and make the report again."""
    seeds: Count = None
    """Independent runs per combination, instead of the study's number."""
    shard: Count = None
    """Largest number of runs simulated together. Results do not depend on it."""
    threads: Count = None
    """Shards at a time. Default: all processors."""
    workers: Count = None
    """Run in this number of processes instead (extra `cluster`)."""
    scheduler: Url = None
    """Run on a Dask scheduler instead, such as tcp://host:8786 (extra `cluster`)."""
    force: bool = False
    """Replace existing files, including results of other commands."""
    yes: bool = False
    """Allow more than a hundred thousand runs."""
    json: Json = False
    """Print summary and warnings as JSON; human-readable text goes to the error stream."""
    watching: Watched = Watching()  # noqa: RUF009  # frozen
    """Live viewing and recording; runs appear as they finish."""
