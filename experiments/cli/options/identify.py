"""Options of `idbench identify`."""

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, final

import tyro

from idbench.experiments.cli.app import command
from idbench.experiments.cli.command import Command
from idbench.experiments.cli.options.shared import LogOptions, Watched
from idbench.experiments.identification.choices import Consistency, Start
from idbench.experiments.identification.defaults import CHAIN
from idbench.experiments.option_types import File, Files, Scenarios, Seconds
from idbench.experiments.recording.audience import Watching


@command("identify")
@final
@dataclass(frozen=True)
class Identify(LogOptions, Command, action="identify:identify"):
    """Identify a log, or several logs in one fit: columns t, q1, ..., tau1, ... in SI units, or as log.toml states."""

    essential: ClassVar[tuple[str, ...]] = (
        "log", "robot", "torque", "torque_delay", "friction", "armature", "resample", "estimator", "validate", "write", "out",
    )  # fmt: skip
    """Options of the short help."""

    log: tyro.conf.Positional[tuple[Path, ...]] = ()
    """Log files: CSV and other text, Parquet, NumPy, Matlab, ROS bags. Times must be uniform to 1 %, otherwise use --resample.
    Or the folder of a run; its recording gets a layer of this identification."""
    chain: str = CHAIN
    """Chain of signal processing, or MODULE:NAME of your own."""
    chain_file: File = None
    """TOML file with settings of the chain: chain = "idbench", then tables such as [operator] with cutoff = 20.0."""
    model: str | None = None
    """all, explicit, implicit, power, or MODULE:CLASS of your own. Default: all; for robots of many joints the screen shows the
    best one."""
    loop: Scenarios = ()
    """Scenario of the control loop of each log, for IV, DIDIM, CLIE and CLOE: robot, motion, controller, timing, drive.
    Default: that of the run's folder."""
    start: Start = "least-squares"
    """Where estimators that simulate or filter start: at the least-squares estimate, or at the robot's file."""
    consistent: Consistency = "no"
    """Move estimates to the nearest physically consistent parameters, in the metric of their covariance (extra `consistent`).
    Unidentifiable parameters are held near the file by the constant pull-back or the entropic distance."""
    follow: Seconds = None
    """Identify a CSV log while it is being written, until it has not grown for this time, then as a whole. --live or --serve
    show estimates and residuals as they develop."""
    validate: Files = ()
    """Held-out logs on which the result is validated. Default: the last quarter of the log, predicted by a fit of the rest."""
    write_mjcf: File = None
    """Write the robot's MJCF file with the identified inertias, armatures and frictions of the first model, made physically
    consistent (extra `consistent`)."""
    write: Files = ()
    """Files to write: .urdf or .xml, the identified robot; .json, base parameters with covariance and regressor; .py, the
    inverse dynamics as a function that needs only NumPy."""
    label: str = ""
    """Name of this identification in a recording. Default: chain and estimator."""
    watching: Watched = Watching()  # noqa: RUF009  # frozen
    """Live viewing and recording."""
