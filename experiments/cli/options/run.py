"""Options of `idbench run`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, final

import tyro

from experiments.cli.app import command
from experiments.cli.command import Command
from experiments.cli.options.shared import Asked, RecordedOptions
from experiments.identification.choices import Consistency, Start
from experiments.identification.defaults import CHAIN, ESTIMATOR
from experiments.identification.parameters import Parameters
from experiments.option_types import Count, Folder, Robot, Scenario, Window


@command("run")
@final
@dataclass(frozen=True)
class Run(RecordedOptions, Command, action="run:run"):
    """Simulate a scenario in closed loop, identify it with all models, and record it."""

    scenario: tyro.conf.Positional[Scenario] = None
    """Name of a scenario that ships, or a file (TOML)."""
    out: Folder = None
    """Folder for summary.json, recording.rrd, log.parquet and scenario.toml; runs/<name of the scenario> by default."""
    chain: str = CHAIN
    """Signal processing, or MODULE:NAME of a chain of yours."""
    estimator: str = ESTIMATOR
    """GLS, ML, ML-delay, ML-reversals, OLS, WLS, IRLS, TLS, RLS, IV, DIDIM, CLIE, CLOE, OE, UKF, or of a plug-in:
    docs/estimators.md."""
    start: Start = "least-squares"
    """Where estimators begin that simulate or filter: at the least-squares estimate, or at the robot's file."""
    consistent: Consistency = "no"
    """Move estimates to the nearest physically consistent parameters, in the metric of their own covariance (extra
    `consistent`); what no motion shows is held near the file by the constant pull-back or the entropic distance."""
    study: Annotated[Path | None, tyro.conf.arg(name="from", metavar="DIR", help_behavior_hint="")] = None
    """Instead of a scenario: the folder of a study, one run of which is made again."""
    index: Count = None
    """Number of that run; its rows must come out with the same bits."""
    method: Count = None
    """Which of the study's combinations of chain, estimator and their settings is shown; the first by default."""
    inner: Window = None
    """From when to when [s] the signals inside the loop are recorded at the full rate of the drive, such as 10 10.5."""
    robot: Robot = None
    """Another robot than the scenario's: name of one that ships, or a file (MJCF or URDF). A trajectory that does not fit it is
    replaced by random moves."""
    yes: bool = False
    """Simulate more than a thousand million physics steps."""
    parameters: Asked = Parameters()  # noqa: RUF009  # frozen
    """Which parameters are identified."""
