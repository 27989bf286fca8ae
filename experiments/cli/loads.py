"""Commands about payloads and gains of drives: their options, and the functions that do the work."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, final

import tyro

from experiments.cli.app import APP
from experiments.cli.interruption import importing
from experiments.cli.options import (
    Asked,
    ColumnOptions,
    Delay,
    File,
    Files,
    Folder,
    Hertz,
    Json,
    Mounted,
    MountingOptions,
    Number,
    Reading,
    Robot,
    Scenario,
    Torque,
)
from experiments.identification.defaults import ESTIMATOR
from experiments.identification.parameters import Parameters

Kilogram = Annotated[float | None, tyro.conf.arg(metavar="KG", help_behavior_hint="")]
Place = Annotated[tuple[float, float, float] | None, tyro.conf.arg(metavar="X Y Z", help_behavior_hint="")]
Six = Annotated[
    tuple[float, float, float, float, float, float] | None,
    tyro.conf.arg(metavar="XX YY ZZ XY XZ YZ", help_behavior_hint=""),
]
Way = Literal["all", "together", "fixed", "apart", "difference"]


@final
@dataclass(frozen=True)
class KnownOptions:
    """What is known of the payload."""

    mass: Kilogram = None
    """Its mass."""
    at: Place = None
    """Its centre of mass in the frame of the last link [m]."""
    inertia: Six = None
    """Its inertia about the centre of mass, in the axes of that frame [kg m^2]."""


Known = Annotated[KnownOptions, tyro.conf.OmitArgPrefixes]


@dataclass(frozen=True)
class LoadOptions:
    """What both commands are given."""

    log: tyro.conf.Positional[tuple[Path, ...]] = ()
    """Logs with the payload."""
    unloaded: Files = ()
    """Logs without it."""
    robot: Robot = None
    """Name of a robot that ships, or a file that describes it."""
    known: Known = KnownOptions()
    """What is known of the payload."""
    torque: Torque = None
    """What a torque sample means; asked for unless the file says it."""
    torque_delay: Delay = None
    """From a sample to the instant it speaks for, in seconds, or `estimate`."""
    reading: Reading = ColumnOptions()  # noqa: RUF009  # frozen
    """What its columns are."""
    mounting: Mounted = MountingOptions()  # noqa: RUF009  # frozen
    """How the robot is mounted."""
    parameters: Asked = Parameters()  # noqa: RUF009  # frozen
    """Which parameters of the robot are asked for."""
    cutoff: Hertz = None
    """Band of the fit [Hz]; by default 5, or what short logs need."""
    estimator: str = ESTIMATOR
    """OLS, WLS, GLS."""
    out: Folder = None
    """Folder for summary.json."""
    force: bool = False
    """Replace results of another experiment in the folder."""
    simulate: Scenario = None
    """Instead of logs: a scenario with a payload, simulated with and without it; what is found is compared with the truth."""
    runs: Number = None
    """How often it is simulated; 20 by default."""
    json: Json = False
    """Print the summary as JSON; what is for people goes to the error stream."""


@APP.command(name="payload")
@final
@dataclass(frozen=True)
class IdentifyPayload(LoadOptions):
    """Identify what the gripper holds: mass, first moments, inertia, from logs with it and logs without it."""

    before: File = None
    """Instead of logs without it: the robot, identified before, as `idbench identify --write FILE.json` leaves it."""
    way: Way = "together"
    """together: all logs in one fit, the best; fixed: the robot first, then the payload alone; apart: both, subtracted;
    difference: of the torques of one repeated motion; all: to compare them."""
    write_mjcf: File = None
    """File to write: the robot's own with the payload as a body, one that can exist."""

    def __call__(self) -> None:
        """Run it."""
        with importing():
            from experiments.cli.loads_command import payload
        payload(self)


@APP.command(name="gains")
@final
@dataclass(frozen=True)
class IdentifyGains(LoadOptions):
    """Identify the gains of drives, torque over current, from logs of currents, without and with a payload of known mass.

    Currents are read with --gain as a first guess, or with 1.
    """

    def __call__(self) -> None:
        """Run it."""
        with importing():
            from experiments.cli.loads_command import gains
        gains(self)
