"""Options of the commands that do a job: its request, and where the results go."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar

from idbench.experiments.cli.command import Command
from idbench.experiments.recording.audience import Watching
from idbench.experiments.requests import jobs
from idbench.experiments.requests.words import File, Files, Folder, Json, Verbose, Window, Word


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
class RecordedOptions(WrittenOptions):
    """Where results go, and how they are watched."""

    watching: Watching = Watching()  # noqa: RUF009  # frozen


@dataclass(frozen=True, kw_only=True)
class RunCommand(jobs.RunRequest, RecordedOptions, Command, called="run", action="run:run", group="Simulate"):
    """Simulate a scenario in closed loop, identify it with all models, and record it."""

    out: Folder = None
    """Folder for summary.json, recording.rrd, log.parquet and scenario.toml. Default: runs/<scenario>."""
    inner: Window = None
    """Interval [s] in which signals inside the control loop are recorded at the full rate of the drive, such as 10 10.5."""
    yes: bool = False
    """Allow more than a thousand million physics steps."""
    verbose: Verbose = False
    """Print details, too: noise, Cond(W), correlations, intervals, iterations."""


@dataclass(frozen=True, kw_only=True)
class Identify(jobs.IdentifyRequest, RecordedOptions, Command, called="identify", action="identify:identify", group="Identify"):
    """Identify a log, or several logs in one fit: columns t, q1, ..., tau1, ... in SI units, or as log.toml states."""

    essential: ClassVar[tuple[str, ...]] = (
        "log", "robot", "torque", "torque_delay", "friction", "armature", "resample", "estimator", "validate", "write", "out",
        "verbose",
    )  # fmt: skip
    """Options of the short help."""

    verbose: Verbose = False
    """Print details, too: noise, Cond(W), correlations, intervals, iterations."""
    write: Files = ()
    """Files to write. The identified robot: .xml, .urdf or .sdf; its joints' actuators: .yaml. For a controller, dynamics and
    regressors as functions: .c, .py; the joints' cogging: cogmap.csv. Base parameters with their covariance: .json. Robots for
    training with code: .toml, or in a folder: .ensemble. Parameters for mujoco.sysid: sysid.py."""
    require: Annotated[str | None, Word("PERCENT")] = None
    """Exit with code 1 unless held-out torque errors are at most this share, as in 2%, and the log would have shown a torque
    constant that is 10 % off."""


@dataclass(frozen=True, kw_only=True)
class Table1Command(jobs.Table1Request, RecordedOptions, Command, called="table1", action="paper:compare", group="Simulate"):
    """Reproduce the paper's simulation comparison (Table 1) and record it."""

    out: Folder = None
    """Folder for summary.json, recording.rrd and log.parquet. Default: runs/table1."""


@dataclass(frozen=True, kw_only=True)
class Table2Command(jobs.Table2Request, RecordedOptions, Command, called="table2", action="paper:table2", group="Simulate"):
    """Repeat the paper's experiment (Table 2) on the virtual robot, and attribute its errors; takes two minutes."""

    out: Path = Path("runs/table2")
    """Folder for summary.json, recording.rrd and the logs of the realizations."""
    inner: Window = None
    """Interval [s] in which signals inside the control loop are recorded at the full rate of the drive, such as 10 10.5."""


@dataclass(frozen=True, kw_only=True)
class SearchCommand(Command, called="search", action="paper:search", group="Simulate"):
    """Search a trajectory with the paper's condition numbers. (`idbench excite` designs better ones.)"""

    seed: int = 0
    """The same seed gives the same trajectory."""
    condition: tuple[float, float] | None = None
    """Cond(W) of the explicit and of the power model. Default: those of Table 1; Table 2 has 37 and 111."""
    out: File = None
    """Scenario file (TOML) to write. Default: print it."""
    force: bool = False
    """Replace an existing file."""


@dataclass(frozen=True, kw_only=True)
class Excite(jobs.ExciteRequest, RecordedOptions, Command, called="excite", action="excite:excite", group="Identify"):
    """Design an exciting trajectory within the robot's limits."""

    out: Folder = None
    """Folder for motion.csv, scenario.toml, summary.json, report.html and recording.rrd. Default: runs/excited-<robot>."""


@dataclass(frozen=True, kw_only=True)
class IdentifyPayload(jobs.PayloadRequest, WrittenOptions, Command, called="payload", action="loads:payload", group="Identify"):
    """Identify what the gripper holds: mass, first moments, inertia, from logs with it and logs without it."""

    write: Files = ()
    """Write the robot's file with the payload as a physically consistent body: .xml."""


@dataclass(frozen=True, kw_only=True)
class IdentifyGains(jobs.GainsRequest, WrittenOptions, Command, called="gains", action="loads:gains", group="Identify"):
    """Identify the torque constants of the drives, gears included, from logs of currents with and without a known payload.

    Currents are read with --gain as a first guess, or with 1.
    """


@dataclass(frozen=True, kw_only=True)
class IdentifyServo(jobs.ServoRequest, RecordedOptions, Command, called="servo", action="servo:servo", group="Identify"):
    """Identify joints under position loops (servos, legs, MuJoCo's actuators) from commands and positions; write them."""

    write: Files = ()
    """Files to write: .xml, the robot's MJCF with these servos as actuators, measured on a log in plain MuJoCo; .py, the servos
    as a Python file (class `Servo`), for your own simulator; .json, parameters of BAM, a file a joint."""
    position: bool = False
    """Write `position` actuators instead of `dcmotor`, for older versions of MuJoCo."""


@dataclass(frozen=True, kw_only=True)
class StudyCommand(jobs.StudyRequest, RecordedOptions, Command, called="study", action="study:study", group="Simulate"):
    """Run a study: simulate a scenario over a grid and many seeds, and identify each run. Without a name: list the studies."""

    out: Folder = None
    """Folder of the study. Default: runs/<study>."""
    yes: bool = False
    """Allow more than a hundred thousand runs."""
