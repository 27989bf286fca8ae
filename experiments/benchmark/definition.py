"""What a set is: a folder with logs, a robot, and a benchmark.toml that states what is fitted and what is held out."""

import shlex
import threading
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Literal

from idbench.experiments.errors import ExperimentError
from idbench.sim.errors import ScenarioError
from idbench.sim.settings import NotNegative, make, settings

FILE = "benchmark.toml"
"""What states the set of a folder."""

SHIPPED = Path(__file__).parent / "sets"
"""Definitions that ship; their data do not."""

WORDS = "options of `idbench {}`, but for logs, --validate and results"

IN_FOLDER = threading.Lock()
"""Held while this process is in the folder of a set: options name files there, and other threads have sets of their own."""

TAKEN = (
    "-h",
    "--help",
    "--help-all",
    "--validate",
    "--out",
    "--force",
    "--json",
    "--write",
    "--write-mjcf",
    "--follow",
    "--live",
    "--serve",
    "--label",
)
"""Options that a set does not state."""


@settings
class Definition:
    """A set of logs."""

    title: str
    """What to call it."""
    fit: tuple[str, ...]
    """Logs that are fitted together; * stands for any letters."""
    held_out: tuple[str, ...] = ()
    """Logs on which the fit is judged. Default: the last quarter of the longest log, which is then not fitted."""
    command: Literal["identify", "servo"] = "identify"
    """The command that identifies them: from torques, or, of servos, from commands and positions alone."""
    options: str = ""
    """How they are identified: options of that command, as on the command line."""
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
    published: str = ""
    """Figures that others have published for these data."""

    def __post_init__(self) -> None:
        if not self.fit or not all(name.strip(" .") for name in self.files):
            raise ValueError(
                f"fit must name at least one log, and each log must have a name: {', '.join(map(repr, self.files))}"
            )
        if taken := [word for word in self.words if word.partition("=")[0].replace("_", "-") in TAKEN]:
            raise ValueError(f"options must not have {taken[0]}: they are {WORDS.format(self.command)}")

    @property
    def words(self) -> list[str]:
        """The options as words; ValueError if a quotation mark has no other."""
        try:
            return shlex.split(self.options)
        except ValueError as error:
            raise ValueError(f"options = {self.options!r:.60}: {error}; each quotation mark needs another") from error

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
        made: Definition = make(Definition, content, "")
        fit, held_out, repeats = (_named(folder, names) for names in (made.fit, made.held_out, made.repeats))
        made = replace(made, fit=fit, held_out=held_out, repeats=repeats)
    except FileNotFoundError as error:
        raise ExperimentError(_missing(folder)) from error
    except OSError as error:
        raise ExperimentError(f"cannot read {path}: {error.strerror}") from error
    except (UnicodeDecodeError, tomllib.TOMLDecodeError, RecursionError, ScenarioError) as error:
        raise ExperimentError(f"{path}: {error}") from error
    return made


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
