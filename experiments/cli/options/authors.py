"""Options of the commands with which authors begin."""

from dataclasses import dataclass
from typing import Annotated, Literal, final

import tyro

from experiments.cli.app import command
from experiments.cli.command import Command
from experiments.option_types import File, Json


@command("new")
@final
@dataclass(frozen=True)
class New(Command, action="authors:begin"):
    """Begin a scenario, a study, or a package of a plug-in: a commented start that runs as it is."""

    what: tyro.conf.Positional[Literal["scenario", "study", "plugin"]]
    """What to begin."""
    name: tyro.conf.Positional[str]
    """What to call it."""
    kind: Annotated[str, tyro.conf.arg(metavar="KIND")] = "estimator"
    """Of a plug-in: estimator, block (a friction law that is identified), friction (of the simulated robot), trajectory,
    controller, drive or encoder."""
    like: Annotated[str, tyro.conf.arg(metavar="SCENARIO")] = "ideal"
    """Of a scenario: that which it starts from."""
    out: File = None
    """File or folder to write; NAME.toml, or NAME, by default."""


@command("check")
@final
@dataclass(frozen=True)
class Check(Command, action="authors:check"):
    """Check whether a plug-in keeps the contract of its point."""

    plugin: tyro.conf.Positional[str]
    """Its name, as idbench list has it; with its point if several have the name (drives/ideal); or MODULE:CLASS."""
    json: Json = False
    """Print what is asked, and why it is not kept, as JSON; what is for people goes to the error stream."""
