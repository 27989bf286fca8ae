"""Options of the commands that show and prepare."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from idbench.experiments.cli.command import Command
from idbench.experiments.requests import words
from idbench.experiments.requests.shared import ColumnOptions, MountingOptions, Parameters
from idbench.experiments.requests.words import Word


@dataclass(frozen=True)
class View(Command, called="view", action="view:view", group="Look"):
    """Open the recording of a results folder in the rerun viewer, or overlay those of several."""

    folders: Annotated[tuple[Path, ...], Word("DIR|FILE", positional=True)] = ()
    """Results folders, or a recording (.rrd). Default: the latest of runs/."""
    tab: str = ""
    """Tab to show first: overview, friction, drive, filters, noise, excitation, parameters, iterations, torques, compare, study
    or table2."""
    save: words.File = None
    """Write the recording and its layers to one file (.rrd) instead of opening them."""
    force: bool = False
    """Replace an existing file."""


@dataclass(frozen=True)
class ShowLog(Command, called="log", action="logs:show_log", group="Look"):
    """Show the contents of a log: columns, units, rate, clock, ranges, noise, encoders. Needs no robot."""

    log: words.Log
    """The file: CSV and other text, Parquet, NumPy, Matlab, a ROS bag; or its log.toml."""
    reading: ColumnOptions = ColumnOptions()  # noqa: RUF009  # frozen
    """What the columns are; guessed from names and values if not stated."""
    write: bool = False
    """Write this description to NAME.toml beside the log, to be corrected. Other commands read the log as it states."""
    picture: words.File = None
    """Write a picture (PNG or SVG): motion, torques, spectra, time steps."""
    force: bool = False
    """Guess again and replace an existing description."""
    json: words.Json = False
    """Print as JSON; human-readable text goes to the error stream."""


@dataclass(frozen=True)
class Resample(Command, called="resample", action="logs:resample", group="Look"):
    """Resample a log at a fixed frequency and repair its clock: repeated rows, jitter, missing samples, gaps."""

    log: words.Log
    """The log, with arbitrary time steps."""
    out: Path
    """File to write, CSV or Parquet. A log with gaps becomes several numbered files."""
    fs: words.Hertz = None
    """Sampling frequency [Hz]. Default: that of the log."""
    reading: ColumnOptions = ColumnOptions()  # noqa: RUF009  # frozen
    torque: words.Torque = None
    """What a torque sample means. Required unless the file states it. A held torque becomes averaged."""
    torque_delay: words.Delay = None
    """Delay from a sample to the torque that it stands for, in seconds."""
    force: bool = False
    """Replace an existing file."""


@dataclass(frozen=True)
class Export(Command, called="export", action="logs:export", group="Look"):
    """Write the logs of a results folder as CSV."""

    folder: words.Log
    """Results folder, such as runs/table2."""
    out: words.Folder = None
    """Folder to write to. Default: the results folder."""
    force: bool = False
    """Replace existing files."""


@dataclass(frozen=True)
class ShowDevice(Command, called="device", action="device:device", group="Look"):
    """Print a servo that was identified from public logs, with standard errors, or of a file of BAM; write it for MuJoCo."""

    name: Annotated[str, Word("NAME", positional=True)] = ""
    """Name of the device, or a parameter file (.json) of BAM. Default: list all."""
    robot: Annotated[str | None, Word("ROBOT")] = None
    """Robot that it drives: name, or file (MJCF or URDF). Default: a pendulum."""
    joints: words.Joints = ()
    """Joints that it drives. Default: all."""
    kp: float = 16.0
    """Gain of the firmware."""
    supply: Annotated[float | None, Word("V")] = None
    """Supply. Default: that at which the device was measured, which files of BAM do not have."""
    write: words.Files = ()
    """Files to write: .xml, the robot with the device as `dcmotor` actuators; .toml, a servo.toml of what is known of it."""
    force: bool = False
    """Replace existing files."""
    json: words.Json = False
    """Print as JSON, with the covariance; human-readable text goes to the error stream."""


@dataclass(frozen=True)
class DescribeRobot(Command, called="robot", action="robot:describe", group="Look"):
    """Show what is identifiable: joints, base parameters, and a torque budget."""

    name: words.ThisRobot
    """Name of a shipped robot, or its file: MJCF, URDF, or a table of Denavit-Hartenberg parameters (.toml)."""
    json: words.Json = False
    """Print joints and parameters as JSON; human-readable text goes to the error stream."""
    parameters: Parameters = Parameters()  # noqa: RUF009  # frozen
    mounting: MountingOptions = MountingOptions()  # noqa: RUF009  # frozen


@dataclass(frozen=True)
class WriteScenario(Command, called="scenario", action="list:write_scenario", group="Extend"):
    """Write a scenario to a file, with every setting explained. Without a name: list the shipped scenarios."""

    name: words.ThisScenario = None
    """Name of a scenario, or a file."""
    out: words.File = None
    """File (TOML) to write. Default: print it."""
    force: bool = False
    """Replace an existing file."""


@dataclass(frozen=True)
class New(Command, called="new", action="authors:begin", group="Extend"):
    """Create a scenario, a study, a plug-in package (templates that run), or an example arm with logs."""

    what: Annotated[Literal["scenario", "study", "plugin", "example"], Word(positional=True)]
    """What to create."""
    name: Annotated[str, Word(positional=True)]
    """Its name."""
    kind: Annotated[str, Word("KIND")] = "estimator"
    """Kind of plug-in: estimator, block (an identified friction law), friction (of the simulated robot), trajectory,
    controller, drive or encoder."""
    like: Annotated[str, Word("SCENARIO")] = "ideal"
    """Scenario to copy."""
    robot: Annotated[str, Word("NAME")] = "two_link"
    """Shipped robot of an example."""
    out: words.File = None
    """File or folder to write. Default: NAME.toml, or NAME."""


@dataclass(frozen=True)
class Check(Command, called="check", action="authors:check", group="Extend"):
    """Check whether a plug-in satisfies the contract of its kind."""

    plugin: Annotated[str, Word(positional=True)]
    """Its name in `idbench list`, with its table if ambiguous (drives/ideal); or MODULE:CLASS."""
    json: words.Json = False
    """Print the checks and their results as JSON; human-readable text goes to the error stream."""


@dataclass(frozen=True)
class Completion(Command, called="completion", action="completion:complete", group="Extend"):
    """Print a script for a shell, which then completes commands and options with the tab key.

    bash: idbench completion bash > ~/.local/share/bash-completion/completions/idbench

    zsh: idbench completion zsh > ~/.zfunc/_idbench, in a folder of fpath, before compinit

    fish: idbench completion fish > ~/.config/fish/completions/idbench.fish

    It completes the word idbench: in a clone, activate .venv first.
    """

    shell: Annotated[Literal["bash", "zsh", "fish"], Word(positional=True)]
    """The shell."""


@dataclass(frozen=True)
class List(Command, called="list", action="list:list_plugins", group="Look"):
    """List all parts that can be combined, built-in and plug-ins."""

    json: words.Json = False
    """Print as JSON."""
