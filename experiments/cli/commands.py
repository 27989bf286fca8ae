"""The commands: their options, and the functions that do the work."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, final

import tyro

from experiments.audience import Watching
from experiments.cli.options import (
    Asked,
    Count,
    Delay,
    File,
    Folder,
    Number,
    Parameters,
    Robot,
    Scenario,
    Torque,
    Watched,
    Window,
)
from experiments.interruption import importing

APP = tyro.extras.SubcommandApp()
"""What the commands register with."""


@APP.command(name="table1")
@final
@dataclass(frozen=True)
class Table1:
    """Reproduce the paper's simulation comparison (Table 1) and record it."""

    out: Folder = None
    """Folder for summary.json, recording.rrd and log.parquet; runs/table1 by default."""
    chain: str = "all"
    """Signal processing: all that the comparison has, or the name of one (paper, paper_masked, idbench, ...)."""
    motions: Count = None
    """Instead of one motion: the errors over so many random ones of the paper's class; into runs/table1-motions by default.
    3500 take some five minutes."""
    seed: Count = None
    """Search another trajectory from this seed instead of taking the one that ships."""
    scenario: Scenario = None
    """Name of a scenario, or a file (TOML), as `idbench search` writes it, instead of the one that ships."""
    force: bool = False
    """Replace results of another experiment in the folder."""
    watching: Watched = Watching()  # noqa: RUF009  # frozen
    """How it is watched."""

    def __call__(self) -> None:
        """Run it."""
        with importing():
            from experiments.table1_command import compare
        compare(self)


@APP.command(name="search")
@final
@dataclass(frozen=True)
class Search:
    """Search a trajectory with the paper's condition numbers."""

    seed: int = 0
    """The same seed gives the same trajectory."""
    out: File = None
    """Scenario file (TOML) to write; printed if none is given."""

    def __call__(self) -> None:
        """Run it."""
        with importing():
            from experiments.table1_command import search
        search(self)


@APP.command(name="list")
@final
@dataclass(frozen=True)
class List:
    """List the plug-ins: what can be combined, one line each."""

    def __call__(self) -> None:
        """Run it."""
        with importing():
            from experiments.plugins import list_plugins
        list_plugins()


@APP.command(name="view")
@final
@dataclass(frozen=True)
class View:
    """Open the recording of a results folder, with all its layers, in the rerun viewer."""

    folder: tyro.conf.Positional[Path]
    """Results folder, or a recording (.rrd)."""
    tab: str = ""
    """What is in front: overview, friction, drive, filters, excitation, parameters, study or table2, as far as it has it."""
    save: File = None
    """Write the recording and its layers to one file (.rrd) instead, to be taken elsewhere."""

    def __call__(self) -> None:
        """Run it."""
        with importing():
            from experiments.viewer import view
        view(self)


@APP.command(name="identify")
@final
@dataclass(frozen=True)
class Identify:
    """Identify a log: CSV or Parquet with the columns t, q1, q2, ..., tau1, tau2, ... in SI units."""

    log: tyro.conf.Positional[Path]
    """The file; its times uniform to 1 %. Or the folder of a run, whose recording gets a layer of this identification."""
    robot: Robot = None
    """Name of a robot that ships, or a file that describes it (MJCF or URDF); scara, or that of the run, by default."""
    torque: Torque = None
    """What a torque sample means: held from its sample on for a period (a controller's command), the torque at an instant
    (a measurement), or the mean over a period. Asked for unless the file says it."""
    torque_delay: Delay = None
    """From a sample to the instant it speaks for, in seconds, or `estimate` to find it from the log."""
    unwrap: bool = False
    """Take jumps of a hinge by about a turn for a change of the turn that is counted, and undo them."""
    chain: str = "idbench"
    """Signal processing."""
    model: str = "all"
    """all, explicit, implicit or power."""
    estimator: str = "WLS"
    """OLS, WLS, ..."""
    validate: File = None
    """A second log, on which the result is judged; without it the last quarter of the first, by a fit of the rest."""
    write_mjcf: File = None
    """File to write: the robot's own with the inertias, armatures and frictions that were found, made physically consistent
    (extra `consistent`); those of the first model."""
    out: Folder = None
    """Folder for summary.json, recording.rrd and log.parquet."""
    force: bool = False
    """Replace results of another experiment in the folder."""
    label: str = ""
    """What to call this identification in a recording; by default chain and estimator. One of that name is replaced."""
    parameters: Asked = Parameters()  # noqa: RUF009  # frozen
    """Which parameters are asked for."""
    watching: Watched = Watching()  # noqa: RUF009  # frozen
    """How it is watched."""

    def __call__(self) -> None:
        """Run it."""
        with importing():
            from experiments.identify_command import identify
        identify(self)


@APP.command(name="robot")
@final
@dataclass(frozen=True)
class DescribeRobot:
    """Tell what can be identified of a robot: its joints, its base parameters, what its torques are made of."""

    name: tyro.conf.Positional[str]
    """Name of a robot that ships, or a file that describes it (MJCF or URDF)."""
    parameters: Asked = Parameters()  # noqa: RUF009  # frozen
    """Which parameters are asked for."""

    def __call__(self) -> None:
        """Run it."""
        with importing():
            from experiments.robot_command import describe
        describe(self)


@APP.command(name="resample")
@final
@dataclass(frozen=True)
class Resample:
    """Write a log anew at a fixed sampling frequency."""

    log: tyro.conf.Positional[Path]
    """The file, CSV or Parquet, its times in any steps."""
    fs: float
    """Sampling frequency [Hz]."""
    out: Path
    """File to write, CSV or Parquet."""
    torque: Torque = None
    """What a torque sample means; asked for unless the file says it. A held torque comes out averaged."""
    torque_delay: Delay = None
    """From a sample to the instant it speaks for, in seconds."""
    force: bool = False
    """Replace a file that is there already."""

    def __call__(self) -> None:
        """Run it."""
        with importing():
            from experiments.log_commands import resample
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
            from experiments.log_commands import export
        export(self)


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
            from experiments.scenario_command import write
        write(self)


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
    chain: str = "idbench"
    """Signal processing."""
    estimator: str = "WLS"
    """OLS, WLS, ..."""
    study: Annotated[Path | None, tyro.conf.arg(name="from", metavar="DIR")] = None
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
    watching: Watched = Watching()  # noqa: RUF009  # frozen
    """How it is watched."""

    def __call__(self) -> None:
        """Run it."""
        with importing():
            from experiments.run_commands import run
        run(self)


@APP.command(name="table2")
@final
@dataclass(frozen=True)
class Table2:
    """Repeat the paper's experiment (Table 2) on the virtual robot, and attribute its errors; takes two minutes."""

    out: Path = Path("runs/table2")
    """Folder for summary.json, recording.rrd and the logs of the realizations."""
    scenario: str = "table2"
    """Name of a scenario, or a file (TOML)."""
    inner: Window = None
    """From when to when [s] the signals inside the loop are recorded at the full rate of the drive, such as 10 10.5."""
    force: bool = False
    """Replace results of another experiment in the folder."""
    watching: Watched = Watching()  # noqa: RUF009  # frozen
    """How it is watched."""

    def __call__(self) -> None:
        """Run it."""
        with importing():
            from experiments.run_commands import table2
        table2(self)


@APP.command(name="study")
@final
@dataclass(frozen=True)
class Study:
    """Run a study: a scenario over a grid and many seeds, identified by every method; without a name, list those that ship."""

    study: tyro.conf.Positional[Annotated[str | None, tyro.conf.arg(metavar="STUDY")]] = None
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
    scheduler: Annotated[str | None, tyro.conf.arg(metavar="URL")] = None
    """Address of a Dask scheduler to run on instead, as tcp://host:8786 (needs the extra `cluster`)."""
    yes: bool = False
    """Run more than a hundred thousand runs."""
    watching: Watched = Watching()  # noqa: RUF009  # frozen
    """How it is watched; runs show as they are finished."""

    def __call__(self) -> None:
        """Run it."""
        with importing():
            from experiments.study_commands import study
        study(self)
