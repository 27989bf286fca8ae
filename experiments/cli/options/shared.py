"""Options that several commands have."""

from dataclasses import dataclass
from typing import Annotated

import tyro

from experiments.identification.defaults import ESTIMATOR
from experiments.identification.parameters import Parameters
from experiments.identification.read_options import ColumnOptions, MountingOptions
from experiments.option_types import Delay, Each, Folder, Hertz, Json, Robot, Torque
from experiments.recording.audience import Watching

Watched = Annotated[Watching, tyro.conf.OmitArgPrefixes, tyro.conf.OmitSubcommandPrefixes]
"""How a command is watched."""

Asked = Annotated[Parameters, tyro.conf.OmitArgPrefixes]
Reading = Annotated[ColumnOptions, tyro.conf.OmitArgPrefixes]
Mounted = Annotated[MountingOptions, tyro.conf.OmitArgPrefixes]


@dataclass(frozen=True, kw_only=True)
class WrittenOptions:
    """Where results go."""

    out: Folder = None
    """Folder for the results."""
    force: bool = False
    """Replace what is there already, results of other commands included."""
    json: Json = False
    """Print summary and warnings as JSON; what is for people goes to the error stream."""


@dataclass(frozen=True, kw_only=True)
class LogOptions(WrittenOptions):
    """How logs are read and identified."""

    robot: Robot = None
    """Name of a robot that ships, or a file that describes it: MJCF, URDF, or a table of DH parameters (.toml); scara, or that
    of the run, by default."""
    torque: Torque = None
    """What a torque sample means: held from its sample on for a period (a controller's command), the torque at an instant
    (a measurement), or the mean over a period. Asked for unless the file says it."""
    torque_delay: Delay = None
    """From a sample to the instant it speaks for, in seconds, or `estimate` to find it from the log."""
    unwrap: bool = False
    """Unwrap 2 pi jumps of the angles."""
    reading: Reading = ColumnOptions()  # noqa: RUF009  # frozen
    """What its columns are."""
    mounting: Mounted = MountingOptions()  # noqa: RUF009  # frozen
    """How the robot is mounted."""
    parameters: Asked = Parameters()  # noqa: RUF009  # frozen
    """Which parameters are asked for."""
    mask_speed: Each = ()
    """Speeds up to which a joint counts as standing or turning, of all joints or of each [rad/s, of slides m/s]: its friction
    is not judged there. By default 5 % of its own rms speed, above the noise of its velocity, and
    as far as its friction is surely another one than in faster motion, up to a fifth of that speed."""
    cutoff: Hertz = None
    """Band of the fit [Hz]; by default 5, or what a short log needs."""
    estimator: str = ESTIMATOR
    """GLS, ML, ML-delay, ML-reversals, OLS, WLS, IRLS, TLS, RLS, IV, DIDIM, CLIE, CLOE, OE, UKF, or of a plug-in:
    docs/estimators.md."""


@dataclass(frozen=True, kw_only=True)
class RecordedOptions(WrittenOptions):
    """Where results go, and how they are watched."""

    watching: Watched = Watching()  # noqa: RUF009  # frozen
    """How it is watched."""
