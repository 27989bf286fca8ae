"""Options of `idbench study`."""

from dataclasses import dataclass
from typing import Annotated, final

import tyro

from experiments.cli.app import command
from experiments.cli.command import Command
from experiments.cli.options.shared import Watched
from experiments.option_types import Count, Folder, Json, Url
from experiments.recording.audience import Watching


@command("study")
@final
@dataclass(frozen=True)
class Study(Command, action="study:study"):
    """Run a study: a scenario over a grid and many seeds, identified by every method; without a name, list those that ship."""

    study: tyro.conf.Positional[Annotated[str | None, tyro.conf.arg(metavar="STUDY", help_behavior_hint="")]] = None
    """Name of a study that ships, or a file (TOML)."""
    out: Folder = None
    """Folder of the study; runs/<name of the study> by default."""
    resume: Folder = None
    """Folder of a study that was interrupted: what it lacks is run, and its report is made anew."""
    seeds: Count = None
    """Independent runs of every combination, instead of the study's own number."""
    shard: Count = None
    """Most runs that are simulated together; no bit depends on it."""
    threads: Count = None
    """Shards at a time; all processors by default."""
    workers: Count = None
    """Processes of this machine to run on instead (needs the extra `cluster`)."""
    scheduler: Url = None
    """Address of a Dask scheduler to run on instead, as tcp://host:8786 (needs the extra `cluster`)."""
    force: bool = False
    """Replace what is there already, results of other commands included."""
    yes: bool = False
    """Run more than a hundred thousand runs."""
    json: Json = False
    """Print summary and warnings as JSON; what is for people goes to the error stream."""
    watching: Watched = Watching()  # noqa: RUF009  # frozen
    """How it is watched; runs show as they are finished."""
