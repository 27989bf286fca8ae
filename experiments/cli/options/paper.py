"""Options of the commands about the paper's tables."""

from dataclasses import dataclass
from pathlib import Path
from typing import final

from idbench.experiments.cli.app import command
from idbench.experiments.cli.command import Command
from idbench.experiments.cli.options.shared import RecordedOptions
from idbench.experiments.option_types import Count, File, Folder, Scenario, Window


@command("table1")
@final
@dataclass(frozen=True)
class Table1(RecordedOptions, Command, action="paper:compare"):
    """Reproduce the paper's simulation comparison (Table 1) and record it."""

    out: Folder = None
    """Folder for summary.json, recording.rrd and log.parquet. Default: runs/table1."""
    chain: str = "all"
    """Chain of signal processing: all, or one by name (paper, paper_masked, idbench, ...)."""
    motions: Count = None
    """Show the errors over this number of random motions of the paper's class (runs/table1-motions). 3500 take about five
    minutes."""
    seed: Count = None
    """Search another trajectory from this seed."""
    scenario: Scenario = None
    """Another scenario: a name, or a file (TOML) as `idbench search` writes it."""


@command("search")
@final
@dataclass(frozen=True)
class Search(Command, action="paper:search"):
    """Search a trajectory with the paper's condition numbers. (`idbench excite` designs better ones.)"""

    seed: int = 0
    """The same seed gives the same trajectory."""
    out: File = None
    """Scenario file (TOML) to write. Default: print it."""
    force: bool = False
    """Replace an existing file."""


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
    """Interval [s] in which signals inside the control loop are recorded at the full rate of the drive, such as 10 10.5."""
