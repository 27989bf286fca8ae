"""Options of the commands about payloads and gains of drives."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, final

import tyro

from idbench.experiments.cli.app import command
from idbench.experiments.cli.command import Command
from idbench.experiments.cli.options.shared import LogOptions
from idbench.experiments.option_types import Count, File, Files, Real, Scenario, Vector

Six = Annotated[
    tuple[float, float, float, float, float, float] | None,
    tyro.conf.arg(metavar="XX YY ZZ XY XZ YZ", help_behavior_hint=""),
]
Way = Literal["all", "together", "fixed", "apart", "difference"]


@final
@dataclass(frozen=True)
class KnownOptions:
    """What is known of the payload."""

    mass: Real = None
    """Its mass [kg]."""
    at: Vector = None
    """Its centre of mass in the frame of the last link [m]."""
    inertia: Six = None
    """Its inertia about the centre of mass, in the axes of that frame [kg m^2]."""


Known = Annotated[KnownOptions, tyro.conf.OmitArgPrefixes]


@dataclass(frozen=True)
class LoadOptions(LogOptions):
    """Options of both commands."""

    log: tyro.conf.Positional[tuple[Path, ...]] = ()
    """Logs with the payload."""
    unloaded: Files = ()
    """Logs without the payload."""
    known: Known = KnownOptions()
    """What is known of the payload."""
    simulate: Scenario = None
    """Simulate a scenario with and without its payload instead of reading logs, and compare the result with the true values."""
    runs: Count = None
    """Number of simulations. Default: 20."""


@command("payload")
@final
@dataclass(frozen=True)
class IdentifyPayload(LoadOptions, Command, action="loads:payload"):
    """Identify what the gripper holds: mass, first moments, inertia, from logs with it and logs without it."""

    before: File = None
    """A robot identified earlier (`idbench identify --write FILE.json`), instead of logs without the payload."""
    way: Way = "together"
    """together: all logs in one fit (best); fixed: first the robot, then the payload; apart: two fits, subtracted; difference:
    of the torques of one repeated motion; all: compare them."""
    write_mjcf: File = None
    """Write the robot's file with the payload as a physically consistent body."""


@command("gains")
@final
@dataclass(frozen=True)
class IdentifyGains(LoadOptions, Command, action="loads:gains"):
    """Identify the torque constants of the drives, gears included, from logs of currents with and without a known payload.

    Currents are read with --gain as a first guess, or with 1.
    """
