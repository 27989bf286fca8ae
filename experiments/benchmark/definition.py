"""What a set is: a folder with logs, a robot, and a benchmark.toml that states what is fitted and what is held out."""

import tomllib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

from idbench.experiments.errors import ExperimentError
from idbench.experiments.requests.jobs import IdentifyRequest, ServoRequest
from idbench.experiments.requests.table import as_table, request_from
from idbench.sim.errors import ScenarioError
from idbench.sim.settings import NotNegative, make, settings

FILE = "benchmark.toml"  # What states the set of a folder
SHIPPED = Path(__file__).parent / "sets"  # Definitions that ship; their data do not

REQUESTS: Mapping[str, type[IdentifyRequest | ServoRequest]] = {"identify": IdentifyRequest, "servo": ServoRequest}
"""What a set may ask for, by the name of the table that states it."""

TAKEN = ("log", "validate", "label")  # Keys of a request that a set states itself, or that say nothing about it


@settings
class PublishedFigure:
    """A figure that others have published for the data of a set."""

    value: NotNegative
    """The figure, in the unit of its metric."""
    metric: Literal["torque error", "position error", "free run"]
    """What of a row it compares with: median torque error of a joint [%]; mean absolute position error from commands alone
    [rad]; NRMSE of free runs."""
    split: str
    """What was fitted, and what the figure was computed on."""
    by: str
    """Whose method it is, and where it was published."""


@settings
class Definition:
    """A set of logs."""

    title: str
    """What to call it."""
    fit: tuple[str, ...]
    """Logs that are fitted together; * stands for any letters."""
    held_out: tuple[str, ...] = ()
    """Logs on which the fit is judged. Default: the last quarter of the longest log, which is then not fitted."""
    identify: dict[str, Any] | None = None
    """How torques and positions are identified: keys of `idbench.fit`, such as robot or friction; files of this folder."""
    servo: dict[str, Any] | None = None
    """How servos are identified, from commands and positions alone: robot, servo, friction."""
    repeats: tuple[str, ...] = ()
    """Logs that are also fitted one by one, to compare their parameters. Default: those of the fit."""
    free_run: NotNegative = 0.0
    """How long the identified robot is simulated from torques alone, again and again along held-out logs [s]; 0: not at all."""
    delay_told: bool = True
    """Whether other tools get fitted torques at the instants when they act; otherwise as late as they are logged."""
    source: str = ""
    """Where the data are from, with their version."""
    license: str = ""
    """Licence of the data."""
    get: str = ""
    """How to get the data: commands, to be run in the folder."""
    published: tuple[PublishedFigure, ...] = ()
    """Figures that others have published for these data."""

    def __post_init__(self) -> None:
        if not self.fit or not all(name.strip(" .") for name in self.files):
            raise ValueError(
                f"fit must name at least one log, and each log must have a name: {', '.join(map(repr, self.files))}"
            )
        if (self.identify is None) == (self.servo is None):
            raise ValueError("give one table, [identify] or [servo]: how the logs are identified")

    @property
    def job(self) -> str:
        """The name of what identifies them."""
        return "servo" if self.identify is None else "identify"

    def request(self, folder: Path) -> IdentifyRequest | ServoRequest:
        """Return what the set asks for, its files in a folder; ExperimentError if a key is unknown, or a value wrong."""
        table = self.servo if self.identify is None else self.identify
        asked = request_from(REQUESTS[self.job], table or {}, f"{folder / FILE}, [{self.job}]", folder, TAKEN)
        fit, held_out = (tuple(folder / name for name in names) for names in (self.fit, self.held_out))
        return replace(asked, log=fit, validate=held_out)

    @property
    def every_repeat(self) -> tuple[str, ...]:
        """Logs that are fitted one by one."""
        return self.repeats or self.fit

    @property
    def files(self) -> tuple[str, ...]:
        """All logs."""
        return tuple(dict.fromkeys([*self.fit, *self.held_out, *self.every_repeat]))


def read_definition(folder: Path) -> Definition:
    """Return the definition of a folder.

    Raises
    ------
    ExperimentError
        If there is none, or it cannot be read.
    """
    path = folder / FILE
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
        _refuse_options(content)
        made: Definition = make(Definition, content, "")
        fit, held_out, repeats = (_named(folder, names) for names in (made.fit, made.held_out, made.repeats))
        made = replace(made, fit=fit, held_out=held_out, repeats=repeats)
    except FileNotFoundError as error:
        raise ExperimentError(_missing(folder)) from error
    except OSError as error:
        raise ExperimentError(f"cannot read {path}: {error.strerror}") from error
    except (UnicodeDecodeError, tomllib.TOMLDecodeError, RecursionError, ScenarioError) as error:
        raise ExperimentError(f"{path}: {error}") from error
    _ = made.request(folder)
    return made


def _refuse_options(content: Mapping[str, Any]) -> None:
    """Raise ScenarioError with the line that stands for the options of a command line, which sets stated before."""
    if (words := content.get("options")) is None:
        return
    job = "servo" if content.get("command") == "servo" else "identify"
    try:
        keys = as_table(REQUESTS[job], words, TAKEN)
    except (ValueError, AttributeError, TypeError):
        keys = "..."
    raise ScenarioError(f"options and command are not read any more: a file names no code; write {job} = {{{keys}}} instead")


def _named(folder: Path, names: tuple[str, ...]) -> tuple[str, ...]:
    """Return names with those of files in the place of patterns that some have."""
    every = {name: sorted(str(path.relative_to(folder)) for path in folder.glob(name)) if "*" in name else [] for name in names}
    return tuple(dict.fromkeys(name for pattern, found in every.items() for name in found or [pattern]))


def shipped() -> tuple[str, ...]:
    """Return the names of the sets that ship."""
    return tuple(sorted(path.parent.name for path in SHIPPED.glob(f"*/{FILE}")))


def _missing(folder: Path) -> str:
    if folder.name in shipped() and not folder.exists():
        name = folder.name
        return f"{folder} is not there: `idbench new set {name}` writes the definition that ships, and says how to get its data"
    known = ", ".join(shipped())
    return f"{folder} has no {FILE}; name folders that have one, or get a definition: `idbench new set NAME`, of {known}"
