"""Options of the commands about the paper's tables."""

from dataclasses import dataclass
from pathlib import Path
from typing import final

from experiments.cli.app import command
from experiments.cli.command import Command
from experiments.cli.options.shared import RecordedOptions
from experiments.option_types import Count, File, Folder, Scenario, Window


@command("table1")
@final
@dataclass(frozen=True)
class Table1(RecordedOptions, Command, action="paper:compare"):
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


@command("search")
@final
@dataclass(frozen=True)
class Search(Command, action="paper:search"):
    """Search a trajectory with the paper's condition numbers: to meet its figures. Those of `idbench excite` tell more."""

    seed: int = 0
    """The same seed gives the same trajectory."""
    out: File = None
    """Scenario file (TOML) to write; printed if none is given."""
    force: bool = False
    """Replace a file that is there already."""


@command("table2")
@final
@dataclass(frozen=True)
class Table2(RecordedOptions, Command, action="paper:table2"):
    """Repeat the paper's experiment (Table 2) on the virtual robot, and attribute its errors; takes two minutes."""

    out: Path = Path("runs/table2")
    """Folder for summary.json, recording.rrd and the logs of the realizations."""
    scenario: str = "table2"
    """Name of a scenario, or a file (TOML)."""
    inner: Window = None
    """From when to when [s] the signals inside the loop are recorded at the full rate of the drive, such as 10 10.5."""
