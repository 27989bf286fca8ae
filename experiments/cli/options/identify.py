"""Options of `idbench identify`."""

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, final

import tyro

from experiments.cli.app import command
from experiments.cli.command import Command
from experiments.cli.options.shared import LogOptions, Watched
from experiments.identification.choices import Consistency, Start
from experiments.identification.defaults import CHAIN
from experiments.option_types import File, Files, Scenarios, Seconds
from experiments.recording.audience import Watching


@command("identify")
@final
@dataclass(frozen=True)
class Identify(LogOptions, Command, action="identify:identify"):
    """Identify a log, or several in one fit: columns t, q1, q2, ..., tau1, tau2, ... in SI units, or what log.toml says."""

    essential: ClassVar[tuple[str, ...]] = (
        "log", "robot", "torque", "torque_delay", "friction", "armature", "resample", "estimator", "validate", "write", "out",
    )  # fmt: skip
    """Options of the short help."""

    log: tyro.conf.Positional[tuple[Path, ...]] = ()
    """The files; their times uniform to 1 %, or --resample. CSV and other text, Parquet, NumPy, Matlab, ROS bags. Or the
    folder of a run, whose recording gets a layer of this identification."""
    chain: str = CHAIN
    """Signal processing, or MODULE:NAME of a chain of yours."""
    chain_file: File = None
    """TOML file with settings of the chain: chain = "idbench", then tables such as [operator] with cutoff = 20.0."""
    model: str | None = None
    """all, explicit, implicit, power, or MODULE:CLASS of a model of yours; by default all, of which the screen shows the best,
    where joints are many."""
    loop: Scenarios = ()
    """Scenarios that describe the closed loop of each log, for IV, DIDIM, CLIE and CLOE: robot, motion, controller, timing,
    drive. Of a run's folder its own."""
    start: Start = "least-squares"
    """Where estimators begin that simulate or filter: at the least-squares estimate, or at the robot's file."""
    consistent: Consistency = "no"
    """Move estimates to the nearest physically consistent parameters, in the metric of their own covariance (extra
    `consistent`); what no motion shows is held near the file by the constant pull-back or the entropic distance."""
    follow: Seconds = None
    """Identify a CSV log while it is being written, until it has not grown for so long; then as a whole. With --live or
    --serve estimates and residuals are seen to grow."""
    validate: Files = ()
    """Held-out logs, on each of which the result is judged; without them the last quarter of the log, by a fit of the rest."""
    write_mjcf: File = None
    """File to write: the robot's own with the inertias, armatures and frictions that were found, made physically consistent
    (extra `consistent`); those of the first model."""
    write: Files = ()
    """Files to write: .urdf or .xml, the robot with what was found; .json, base parameters with their covariance and regressor;
    .py, a function of the inverse dynamics that needs NumPy alone."""
    label: str = ""
    """What to call this identification in a recording; by default chain and estimator."""
    watching: Watched = Watching()  # noqa: RUF009  # frozen
    """How it is watched."""
