"""Options of the commands with which authors begin."""

from dataclasses import dataclass
from typing import Annotated, Literal, final

import tyro

from idbench.experiments.cli.app import command
from idbench.experiments.cli.command import Command
from idbench.experiments.option_types import File, Json


@command("new")
@final
@dataclass(frozen=True)
class New(Command, action="authors:begin"):
    """Create a scenario, a study, a plug-in package (templates that run), an example arm with logs, or a set of public logs."""

    what: tyro.conf.Positional[Literal["scenario", "study", "plugin", "example", "set"]]
    """What to create. Of a set, of those that `idbench benchmark` lists, it is the definition; it says how to get the logs."""
    name: tyro.conf.Positional[str]
    """Its name."""
    kind: Annotated[str, tyro.conf.arg(metavar="KIND")] = "estimator"
    """Kind of plug-in: estimator, block (an identified friction law), friction (of the simulated robot), trajectory,
    controller, drive or encoder."""
    like: Annotated[str, tyro.conf.arg(metavar="SCENARIO")] = "ideal"
    """Scenario to copy."""
    out: File = None
    """File or folder to write. Default: NAME.toml, or NAME."""


@command("check")
@final
@dataclass(frozen=True)
class Check(Command, action="authors:check"):
    """Check whether a plug-in satisfies the contract of its kind."""

    plugin: tyro.conf.Positional[str]
    """Its name in `idbench list`, with its table if ambiguous (drives/ideal); or MODULE:CLASS."""
    json: Json = False
    """Print the checks and their results as JSON; human-readable text goes to the error stream."""


@command("list")
@final
@dataclass(frozen=True)
class List(Command, action="list:list_plugins"):
    """List all parts that can be combined, built-in and plug-ins."""

    json: Json = False
    """Print as JSON."""
