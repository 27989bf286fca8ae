"""Options of the commands about payloads and gains of drives."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, final

import tyro

from experiments.cli.app import command
from experiments.cli.command import Command
from experiments.cli.options.shared import LogOptions
from experiments.option_types import Count, File, Files, Real, Scenario, Vector

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
    """What both commands are given."""

    log: tyro.conf.Positional[tuple[Path, ...]] = ()
    """Logs with the payload."""
    unloaded: Files = ()
    """Logs without it."""
    known: Known = KnownOptions()
    """What is known of the payload."""
    simulate: Scenario = None
    """Instead of logs: a scenario with a payload, simulated with and without it; what is found is compared with the truth."""
    runs: Count = None
    """How often it is simulated; 20 by default."""


@command("payload")
@final
@dataclass(frozen=True)
class IdentifyPayload(LoadOptions, Command, action="loads:payload"):
    """Identify what the gripper holds: mass, first moments, inertia, from logs with it and logs without it."""

    before: File = None
    """Instead of logs without it: the robot, identified before, as `idbench identify --write FILE.json` leaves it."""
    way: Way = "together"
    """together: all logs in one fit, the best; fixed: the robot first, then the payload alone; apart: both, subtracted;
    difference: of the torques of one repeated motion; all: to compare them."""
    write_mjcf: File = None
    """File to write: the robot's own with the payload as a physically consistent body."""


@command("gains")
@final
@dataclass(frozen=True)
class IdentifyGains(LoadOptions, Command, action="loads:gains"):
    """Identify the gains of drives, torque over current, from logs of currents, without and with a payload of known mass.

    Currents are read with --gain as a first guess, or with 1.
    """
