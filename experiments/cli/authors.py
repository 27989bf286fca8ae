"""Commands for authors: their options, and the functions that do the work."""

from dataclasses import dataclass
from typing import Annotated, Literal, final

import tyro

from experiments.cli.app import APP
from experiments.cli.interruption import importing
from experiments.cli.options import File, Json


@APP.command(name="new")
@final
@dataclass(frozen=True)
class New:
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

    def __call__(self) -> None:
        """Run it."""
        with importing():
            from experiments.cli.author_commands import begin
        begin(self)


@APP.command(name="check")
@final
@dataclass(frozen=True)
class Check:
    """Check whether a plug-in keeps the contract of its point."""

    plugin: tyro.conf.Positional[str]
    """Its name, as idbench list has it; with its point if several have the name (drives/ideal); or MODULE:CLASS."""
    json: Json = False
    """Print what is asked, and why it is not kept, as JSON; what is for people goes to the error stream."""

    def __call__(self) -> None:
        """Run it."""
        with importing():
            from experiments.cli.author_commands import check
        check(self)
