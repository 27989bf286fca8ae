"""Commands about logs and robots: their options, and the functions that do the work."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, final

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
    Loops,
    Mounted,
    MountingOptions,
    Reading,
    Robot,
    Torque,
    Watched,
)
from experiments.identification.choices import Consistency, Start
from experiments.identification.defaults import CHAIN, ESTIMATOR
from experiments.identification.parameters import Parameters
from experiments.recording.audience import Watching


@APP.command(name="identify")
@final
@dataclass(frozen=True)
class Identify:
    """Identify a log, or several in one fit: columns t, q1, q2, ..., tau1, tau2, ... in SI units, or what log.toml says."""

    log: tyro.conf.Positional[tuple[Path, ...]]
    """The files; their times uniform to 1 %, or --resample. CSV and other text, Parquet, NumPy, Matlab, ROS bags. Or the
    folder of a run, whose recording gets a layer of this identification."""
    robot: Robot = None
    """Name of a robot that ships, or a file that describes it: MJCF, URDF, or a table of DH parameters (.toml); scara, or that
    of the run, by default."""
    torque: Torque = None
    """What a torque sample means: held from its sample on for a period (a controller's command), the torque at an instant
    (a measurement), or the mean over a period. Asked for unless the file says it."""
    torque_delay: Delay = None
    """From a sample to the instant it speaks for, in seconds, or `estimate` to find it from the log."""
    unwrap: bool = False
    """Take jumps of a hinge by about a turn for a change of the turn that is counted, and undo them."""
    reading: Reading = ColumnOptions()  # noqa: RUF009  # frozen
    """What its columns are."""
    mounting: Mounted = MountingOptions()  # noqa: RUF009  # frozen
    """How the robot is mounted."""
    chain: str = CHAIN
    """Signal processing."""
    cutoff: Hertz = None
    """Band of the fit [Hz]; by default 5, or what a short log needs."""
    chain_file: File = None
    """TOML file with settings of the chain: chain = "idbench", then tables such as [operator] with cutoff = 20.0."""
    model: str = "all"
    """all, explicit, implicit or power."""
    estimator: str = ESTIMATOR
    """GLS, ML, OLS, WLS, IRLS, TLS, RLS, IV, DIDIM, CLIE, CLOE, OE, UKF, ML-delay, or of a plug-in: docs/estimators.md."""
    loop: Loops = ()
    """Scenarios that describe the closed loop of each log, for IV, DIDIM, CLIE and CLOE: robot, motion, controller, timing,
    drive. Of a run's folder its own."""
    start: Start = "least-squares"
    """Where estimators begin that simulate or filter: at the least-squares estimate, or at the robot's file."""
    consistent: Consistency = "no"
    """Move estimates to the nearest at which bodies can exist, in the metric of their own sigma (extra `consistent`); what no
    motion shows is held near the file by the constant pull-back or the entropic distance."""
    follow: Annotated[float | None, tyro.conf.arg(metavar="SECONDS", help_behavior_hint="")] = None
    """Identify a CSV log while it is being written, until it has not grown for so long; then as a whole. With --live or
    --serve estimates and residuals are seen to grow."""
    validate: Files = ()
    """Other logs, on each of which the result is judged; without them the last quarter of the log, by a fit of the rest."""
    write_mjcf: File = None
    """File to write: the robot's own with the inertias, armatures and frictions that were found, made physically consistent
    (extra `consistent`); those of the first model."""
    write: Files = ()
    """Files to write: .urdf or .xml, the robot with what was found; .json, base parameters with their covariance and regressor;
    .py, a function of the inverse dynamics that needs NumPy alone."""
    out: Folder = None
    """Folder for summary.json, report.html, recording.rrd and log.parquet."""
    force: bool = False
    """Replace results of another experiment in the folder."""
    label: str = ""
    """What to call this identification in a recording; by default chain and estimator. One of that name is replaced."""
    parameters: Asked = Parameters()  # noqa: RUF009  # frozen
    """Which parameters are asked for."""
    json: Json = False
    """Print summary and warnings as JSON; what is for people goes to the error stream."""
    watching: Watched = Watching()  # noqa: RUF009  # frozen
    """How it is watched."""

    def __call__(self) -> None:
        """Run it."""
        with importing():
            from experiments.cli.identify_command import identify
        identify(self)


@APP.command(name="robot")
@final
@dataclass(frozen=True)
class DescribeRobot:
    """Show what can be identified of a robot: its joints, its base parameters, what its torques are made of."""

    name: tyro.conf.Positional[str]
    """Name of a robot that ships, or a file that describes it: MJCF, URDF, or a table of DH parameters (.toml)."""
    json: Json = False
    """Print joints and parameters as JSON; what is for people goes to the error stream."""
    parameters: Asked = Parameters()  # noqa: RUF009  # frozen
    """Which parameters are asked for."""
    mounting: Mounted = MountingOptions()  # noqa: RUF009  # frozen
    """How the robot is mounted."""

    def __call__(self) -> None:
        """Run it."""
        with importing():
            from experiments.cli.robot_command import describe
        describe(self)


@APP.command(name="log")
@final
@dataclass(frozen=True)
class ShowLog:
    """Show what is understood of a log: its columns and units, rate and clock, ranges, noise, encoders. Needs no robot."""

    log: tyro.conf.Positional[Path]
    """The file: CSV and other text, Parquet, NumPy, Matlab, a ROS bag; or its log.toml."""
    reading: Reading = ColumnOptions()  # noqa: RUF009  # frozen
    """What its columns are; guessed from their names and values if nothing says it."""
    write: bool = False
    """Write what was understood as a file beside the log, NAME.toml, to be corrected: what is read later is what it says."""
    picture: File = None
    """Picture to write, PNG or SVG: motion, torques, spectra, time steps."""
    force: bool = False
    """Guess anew although there is such a file, and replace it."""
    json: Json = False
    """Print the same as JSON; what is for people goes to the error stream."""

    def __call__(self) -> None:
        """Run it."""
        with importing():
            from experiments.cli.show_log import show_log
        show_log(self)


@APP.command(name="resample")
@final
@dataclass(frozen=True)
class Resample:
    """Write a log anew at a fixed sampling frequency, its clock repaired: repeated rows, jitter, drops, gaps."""

    log: tyro.conf.Positional[Path]
    """The file, its times in any steps."""
    out: Path
    """File to write, CSV or Parquet; a log with gaps becomes several, numbered."""
    fs: Hertz = None
    """Sampling frequency [Hz]; by default that of the log."""
    reading: Reading = ColumnOptions()  # noqa: RUF009  # frozen
    """What its columns are."""
    torque: Torque = None
    """What a torque sample means; asked for unless the file says it. A held torque comes out averaged."""
    torque_delay: Delay = None
    """From a sample to the instant it speaks for, in seconds."""
    force: bool = False
    """Replace a file that is there already."""

    def __call__(self) -> None:
        """Run it."""
        with importing():
            from experiments.cli.log_commands import resample
        resample(self)


@APP.command(name="export")
@final
@dataclass(frozen=True)
class Export:
    """Write the logs of a results folder as CSV."""

    folder: tyro.conf.Positional[Path]
    """Results folder, such as runs/table2."""
    out: Folder = None
    """Folder to write to; the results folder itself by default."""
    force: bool = False
    """Replace files with other contents."""

    def __call__(self) -> None:
        """Run it."""
        with importing():
            from experiments.cli.log_commands import export
        export(self)
