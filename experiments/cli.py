"""The command line."""

import os
import sys
from collections.abc import Sequence
from pathlib import Path

import tomli_w
import tyro
from rich.console import Console

from experiments.errors import ExperimentError
from experiments.results import results_folder, write_summary
from experiments.search import Search
from identify import IdentificationError
from identify.log_file import write_log
from sim.errors import BenchError
from sim.robot import Robot
from sim.scenario import Scenario

DESCRIPTION = "A MuJoCo testbench for the dynamic identification of robots."

app = tyro.extras.SubcommandApp()
console = Console(highlight=False)


@app.command(name="table1")
def table1(out: Path = Path("runs/table1"), chain: str = "both", seed: int | None = None) -> None:
    """Reproduce the paper's simulation comparison (Table 1) and record it.

    Args:
        out: Folder for summary.json, recording.rrd and log.parquet.
        chain: Signal processing: both, or the name of one chain (paper, idbench, ...).
        seed: Search another trajectory from this seed instead of the one that ships.
    """
    from experiments.recording.table1 import record_table1
    from experiments.report import print_table1
    from experiments.table1 import SCENARIO, Table1

    chains = ("paper", "idbench") if chain == "both" else (chain,)
    with results_folder(out) as folder:
        table = Table1(Scenario.load(SCENARIO) if seed is None else _search(seed), chains)
        write_log(table.log, folder / "log.parquet")
        record_table1(folder / "recording.rrd", table)
        write_summary(folder / "summary.json", table.summary())
    print_table1(console, table)
    console.print(f"written to {out}; see it: idbench view {out}")


@app.command(name="search")
def search(seed: int = 0, out: Path | None = None) -> None:
    """Search a trajectory with the paper's condition numbers.

    Args:
        seed: The same seed gives the same trajectory.
        out: Scenario file (TOML) to write; printed if none is given.
    """
    scenario = _search(seed)
    text = tomli_w.dumps(scenario.to_dict())
    if out is None:
        sys.stdout.write(text)
        return
    try:
        out.write_text(text)
    except OSError as error:
        raise ExperimentError(f"cannot write {out}: {error.strerror}") from error
    console.print(f"{out}: {scenario.origin}")


@app.command(name="list")
def list_plugins() -> None:
    """List the plug-ins: what can be combined, one line each."""
    from experiments.plugins import print_plugins

    print_plugins(console)


@app.command(name="view")
def view(folder: tyro.conf.Positional[Path]) -> None:
    """Open the recording of a results folder in the rerun viewer.

    Args:
        folder: Results folder, or a recording (.rrd).
    """
    from experiments.viewer import view as open_viewer

    sys.exit(open_viewer(folder))


def _search(seed: int) -> Scenario:
    with console.status("searching a trajectory ...") as status:
        return Search(seed=seed).run(
            Robot.load("scara"),
            lambda number, distance: status.update(f"searching: round {number}, {distance:.1%} from the paper's Cond(W)"),
        )


def main(args: Sequence[str] | None = None) -> int:
    """Run the command line; return its exit code: 0, 2 for wrong input, 130 when interrupted."""
    try:
        app.cli(prog="idbench", description=DESCRIPTION, args=args)
    except (IdentificationError, BenchError, ExperimentError) as error:
        print(f"idbench: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("idbench: interrupted; nothing was written", file=sys.stderr)
        return 130
    except BrokenPipeError:  # the reader of our output has gone, as `head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    return 0
