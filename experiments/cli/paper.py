"""Commands about the paper's tables: their options, and the functions that do the work."""

from dataclasses import dataclass
from pathlib import Path
from typing import final

from experiments.cli.app import APP
from experiments.cli.interruption import importing
from experiments.cli.options import Count, File, Folder, Json, Scenario, Watched, Window
from experiments.recording.audience import Watching


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
    json: Json = False
    """Print summary and warnings as JSON; what is for people goes to the error stream."""
    watching: Watched = Watching()  # noqa: RUF009  # frozen
    """How it is watched."""

    def __call__(self) -> None:
        """Run it."""
        with importing():
            from experiments.cli.table1_command import compare
        compare(self)


@APP.command(name="search")
@final
@dataclass(frozen=True)
class Search:
    """Search a trajectory with the paper's condition numbers: to meet its figures. Those of `idbench excite` tell more."""

    seed: int = 0
    """The same seed gives the same trajectory."""
    out: File = None
    """Scenario file (TOML) to write; printed if none is given."""

    def __call__(self) -> None:
        """Run it."""
        with importing():
            from experiments.cli.table1_command import search
        search(self)


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
    json: Json = False
    """Print summary and warnings as JSON; what is for people goes to the error stream."""
    watching: Watched = Watching()  # noqa: RUF009  # frozen
    """How it is watched."""

    def __call__(self) -> None:
        """Run it."""
        with importing():
            from experiments.cli.run_commands import table2
        table2(self)
