"""Commands that simulate: their options, and the functions that do the work."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, final

import tyro

from experiments.cli.app import APP
from experiments.cli.interruption import importing
from experiments.cli.options import Asked, Count, File, Folder, Json, Number, Robot, Scenario, Watched, Window
from experiments.identification.choices import Consistency, Start
from experiments.identification.defaults import CHAIN, ESTIMATOR
from experiments.identification.parameters import Parameters
from experiments.recording.audience import Watching


@APP.command(name="run")
@final
@dataclass(frozen=True)
class Run:
    """Simulate a scenario in closed loop, identify it with all models, and record it."""

    scenario: tyro.conf.Positional[Scenario] = None
    """Name of a scenario that ships, or a file (TOML)."""
    out: Folder = None
    """Folder for summary.json, recording.rrd, log.parquet and scenario.toml; runs/<name of the scenario> by default."""
    force: bool = False
    """Replace results of another experiment in the folder."""
    chain: str = CHAIN
    """Signal processing."""
    estimator: str = ESTIMATOR
    """GLS, ML, OLS, WLS, IRLS, TLS, RLS, IV, DIDIM, CLIE, CLOE, OE, UKF, ML-delay, or of a plug-in: docs/estimators.md."""
    start: Start = "least-squares"
    """Where estimators begin that simulate or filter: at the least-squares estimate, or at the robot's file."""
    consistent: Consistency = "no"
    """Move estimates to the nearest at which bodies can exist, in the metric of their own sigma (extra `consistent`); what no
    motion shows is held near the file by the constant pull-back or the entropic distance."""
    study: Annotated[Path | None, tyro.conf.arg(name="from", metavar="DIR", help_behavior_hint="")] = None
    """Instead of a scenario: the folder of a study, one run of which is made again."""
    index: Number = None
    """Number of that run; its rows must come out with the same bits."""
    method: Number = None
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
    json: Json = False
    """Print summary and warnings as JSON; what is for people goes to the error stream."""
    watching: Watched = Watching()  # noqa: RUF009  # frozen
    """How it is watched."""

    def __call__(self) -> None:
        """Run it."""
        with importing():
            from experiments.cli.run_commands import run
        run(self)


@APP.command(name="study")
@final
@dataclass(frozen=True)
class Study:
    """Run a study: a scenario over a grid and many seeds, identified by every method; without a name, list those that ship."""

    study: tyro.conf.Positional[Annotated[str | None, tyro.conf.arg(metavar="STUDY", help_behavior_hint="")]] = None
    """Name of a study that ships, or a file (TOML)."""
    out: Folder = None
    """Folder of the study; runs/<name of the study> by default."""
    resume: Folder = None
    """Folder of a study that was interrupted: what it lacks is run, and its report is made anew."""
    seeds: Count = None
    """Independent runs of every combination, instead of the study's own number."""
    shard: Count = None
    """Most runs that are simulated together; no bit depends on it."""
    threads: Count = None
    """Shards at a time; all processors by default."""
    workers: Count = None
    """Processes of this machine to run on instead (needs the extra `cluster`)."""
    scheduler: Annotated[str | None, tyro.conf.arg(metavar="URL", help_behavior_hint="")] = None
    """Address of a Dask scheduler to run on instead, as tcp://host:8786 (needs the extra `cluster`)."""
    yes: bool = False
    """Run more than a hundred thousand runs."""
    json: Json = False
    """Print summary and warnings as JSON; what is for people goes to the error stream."""
    watching: Watched = Watching()  # noqa: RUF009  # frozen
    """How it is watched; runs show as they are finished."""

    def __call__(self) -> None:
        """Run it."""
        with importing():
            from experiments.cli.study_commands import study
        study(self)


@APP.command(name="scenario")
@final
@dataclass(frozen=True)
class WriteScenario:
    """Write a scenario out to start from, every setting explained; without a name, list those that ship."""

    name: tyro.conf.Positional[Scenario] = None
    """Name of a scenario, or a file."""
    out: File = None
    """File (TOML) to write; printed if none is given."""

    def __call__(self) -> None:
        """Run it."""
        with importing():
            from experiments.cli.scenario_command import write
        write(self)
