"""The commands."""

import os
import sys
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Annotated

import tyro
from rich.console import Console

import experiments.identify_command
import experiments.log_commands
import experiments.robot_command
import experiments.run_commands
import experiments.scenario_command
import experiments.study_commands  # noqa: F401  # all register their commands
from experiments.app import app
from experiments.audience import Watched, Watching
from experiments.errors import ExperimentError
from experiments.interruption import INTERRUPTED, importing, terminating
from experiments.page import new_page, show, shown
from experiments.results import results_folder, tell_of, write_recording, write_summary, write_whole
from experiments.search import Search
from identify import IdentificationError
from identify.log_file import write_log
from sim.errors import BenchError
from sim.robot import Robot
from sim.scenario import Scenario
from sim.scenario_file import load, to_toml

DESCRIPTION = "A MuJoCo testbench for the dynamic identification of robots."

Seed = Annotated[int | None, tyro.conf.arg(metavar="INT")]
Name = Annotated[str | None, tyro.conf.arg(metavar="NAME")]
File = Annotated[Path | None, tyro.conf.arg(metavar="FILE")]


@app.command(name="table1")
def table1(
    out: Path = Path("runs/table1"),
    chain: str = "both",
    seed: Seed = None,
    scenario: Name = None,
    watching: Watched = Watching(),  # noqa: B008  # frozen
) -> None:
    """Reproduce the paper's simulation comparison (Table 1) and record it.

    Args:
        out: Folder for summary.json, recording.rrd and log.parquet.
        chain: Signal processing: both, or the name of one chain (paper, idbench, ...).
        seed: Search another trajectory from this seed instead of taking the one that ships.
        scenario: Name of a scenario, or a file (TOML), as `idbench search` writes it, instead of the one that ships.
        watching: How it is watched.
    """
    with importing():
        from experiments.report import print_table1
        from experiments.table1 import SCENARIO, Table1

    if seed is not None and scenario is not None:
        raise ExperimentError(f"--seed {seed} and --scenario {scenario} name two trajectories: give one")
    chains = ("paper", "idbench") if chain == "both" else (chain,)
    page, lost = new_page(), ""
    with watching.audience() as audience, shown(page):
        with results_folder(out) as folder:
            table = Table1(load(scenario or SCENARIO) if seed is None else _search(seed), chains)
            print_table1(page, table)
            write_log(table.log, folder / "log.parquet")
            write_summary(folder / "summary.json", table.summary())
            if watching.rerun:
                from experiments.recording.table1 import record_table1

                lost = write_recording(folder, record_table1(table, audience))
        tell_of(lost, out)
        page.print(f"written to {out}{watching.hint(out)}", soft_wrap=True)


@app.command(name="search")
def search(seed: int = 0, out: File = None) -> None:
    """Search a trajectory with the paper's condition numbers.

    Args:
        seed: The same seed gives the same trajectory.
        out: Scenario file (TOML) to write; printed if none is given.
    """
    scenario, page = _search(seed), new_page()
    text = to_toml(scenario)
    if out is not None:
        write_whole(out, text)
    page.out(f"{out}: {scenario.origin}" if out is not None else text.rstrip("\n"))
    show(page)


@app.command(name="list")
def list_plugins() -> None:
    """List the plug-ins: what can be combined, one line each."""
    from experiments.plugins import print_plugins

    page = new_page()
    print_plugins(page)
    show(page)


@app.command(name="view")
def view(folder: tyro.conf.Positional[Path], tab: str = "", save: File = None) -> None:
    """Open the recording of a results folder, with all its layers, in the rerun viewer.

    Args:
        folder: Results folder, or a recording (.rrd).
        tab: What is in front: overview, friction, drive, filters, excitation, parameters, study or table2, as far as it has it.
        save: Write the recording and its layers to one file (.rrd) instead, to be taken elsewhere.
    """
    with importing():
        from experiments.viewer import save as save_as
        from experiments.viewer import view as open_viewer

    if save is None:
        open_viewer(folder, tab)
        return
    page = new_page()
    save_as(folder, tab, save)
    page.print(f"written to {save}", soft_wrap=True)
    show(page)


def _search(seed: int) -> Scenario:
    with Console(stderr=True).status("searching a trajectory ...") as status:
        return Search(seed=seed).run(
            Robot.load("scara"),
            lambda number, distance: status.update(f"searching: round {number}, {distance:.1%} from the paper's Cond(W)"),
        )


def run(args: Sequence[str] | None = None) -> int:
    """Run a command; return its exit code: 0, 2 for wrong input, 130 when interrupted."""
    words = sys.argv[1:] if args is None else list(args)
    try:
        with terminating():
            if words == ["--version"]:
                page = new_page()
                page.print(f"idbench {version('idbench')}")
                show(page)
            else:
                app.cli(prog="idbench", description=DESCRIPTION, args=words)
    except (IdentificationError, BenchError, ExperimentError) as error:
        return _complain(str(error), 2)
    except KeyboardInterrupt:
        return _complain("interrupted", INTERRUPTED)
    except BrokenPipeError:  # the reader of our output has gone, as `head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return 0


def _complain(what: str, code: int) -> int:
    print(f"idbench: {what}", file=sys.stderr)
    return code
