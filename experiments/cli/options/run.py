"""Options of `idbench run`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, final

import tyro

from idbench.experiments.cli.app import command
from idbench.experiments.cli.command import Command
from idbench.experiments.cli.options.shared import Asked, RecordedOptions
from idbench.experiments.identification.choices import Consistency, Start
from idbench.experiments.identification.defaults import CHAIN, ESTIMATOR
from idbench.experiments.identification.parameters import Parameters
from idbench.experiments.option_types import Count, Folder, Robot, Scenario, Window


@command("run")
@final
@dataclass(frozen=True)
class Run(RecordedOptions, Command, action="run:run"):
    """Simulate a scenario in closed loop, identify it with all models, and record it."""

    scenario: tyro.conf.Positional[Scenario] = None
    """Name of a shipped scenario, or its file (TOML)."""
    out: Folder = None
    """Folder for summary.json, recording.rrd, log.parquet and scenario.toml. Default: runs/<scenario>."""
    chain: str = CHAIN
    """Chain of signal processing, or MODULE:NAME of your own."""
    estimator: str = ESTIMATOR
    """GLS, ML, ML-delay, ML-reversals, OLS, WLS, IRLS, TLS, RLS, IV, DIDIM, CLIE, CLOE, OE, UKF, or a plug-in; see
    docs/estimators.md."""
    start: Start = "least-squares"
    """Where estimators that simulate or filter start: at the least-squares estimate, or at the robot's file."""
    consistent: Consistency = "no"
    """Move estimates to the nearest physically consistent parameters, in the metric of their covariance (extra `consistent`).
    Unidentifiable parameters are held near the file by the constant pull-back or the entropic distance."""
    study: Annotated[Path | None, tyro.conf.arg(name="from", metavar="DIR", help_behavior_hint="")] = None
    """Repeat one run of a study, given by its folder, instead of a scenario."""
    index: Count = None
    """Number of that run. Its rows must have the same bits."""
    method: Count = None
    """Which of the study's combinations of chain, estimator and settings is shown. Default: the first."""
    inner: Window = None
    """Interval [s] in which signals inside the control loop are recorded at the full rate of the drive, such as 10 10.5."""
    robot: Robot = None
    """Another robot: name of a shipped one, or a file (MJCF or URDF). A trajectory that does not fit it is replaced by random
    moves."""
    yes: bool = False
    """Allow more than a thousand million physics steps."""
    parameters: Asked = Parameters()  # noqa: RUF009  # frozen
    """Which parameters are identified."""
