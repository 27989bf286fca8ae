"""Options that several commands have."""

from dataclasses import dataclass
from typing import Annotated

import tyro

from idbench.experiments.identification.defaults import ESTIMATOR
from idbench.experiments.identification.parameters import Parameters
from idbench.experiments.identification.read_options import ColumnOptions, MountingOptions
from idbench.experiments.option_types import Delay, Each, Folder, Hertz, Json, Robot, Torque
from idbench.experiments.recording.audience import Watching

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
    """Replace existing files, including results of other commands."""
    json: Json = False
    """Print summary and warnings as JSON; human-readable text goes to the error stream."""


@dataclass(frozen=True, kw_only=True)
class LogOptions(WrittenOptions):
    """How logs are read and identified."""

    robot: Robot = None
    """Name of a shipped robot, or its file: MJCF, URDF, or a table of Denavit-Hartenberg parameters (.toml). Default: scara, or
    the robot of the run."""
    torque: Torque = None
    """What a torque sample means: held for one period from its sample on (a controller's command), the torque at that instant
    (a measurement), or the mean over the period. Required unless the file states it."""
    torque_delay: Delay = None
    """Delay from a sample to the torque that it stands for, in seconds, or `estimate` to estimate it from the log."""
    unwrap: bool = False
    """Unwrap 2 pi jumps of the angles."""
    reading: Reading = ColumnOptions()  # noqa: RUF009  # frozen
    """What the columns are."""
    mounting: Mounted = MountingOptions()  # noqa: RUF009  # frozen
    """How the robot is mounted."""
    parameters: Asked = Parameters()  # noqa: RUF009  # frozen
    """Which parameters are identified."""
    mask_speed: Each = ()
    """Speed below which a joint counts as resting or reversing, for all joints or for each [rad/s, m/s]; such instants are
    masked. Default: 5 % of its rms speed or 4 times the noise of its velocity, raised up to 20 % where its friction differs
    significantly from that of faster motion."""
    cutoff: Hertz = None
    """Cut-off of the low-pass [Hz]. Default: 5, or what a short log needs."""
    estimator: str = ESTIMATOR
    """GLS, ML, ML-delay, ML-reversals, OLS, WLS, IRLS, TLS, RLS, IV, DIDIM, CLIE, CLOE, OE, UKF, or a plug-in; see
    docs/estimators.md."""


@dataclass(frozen=True, kw_only=True)
class RecordedOptions(WrittenOptions):
    """Where results go, and how they are watched."""

    watching: Watched = Watching()  # noqa: RUF009  # frozen
    """Live viewing and recording."""
