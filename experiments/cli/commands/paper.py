"""The commands about the paper's tables: the comparison, the search for its trajectory, the experiment repeated."""

from collections.abc import Iterator
from contextlib import closing, contextmanager
from functools import partial
from pathlib import Path

from rich.console import Console

from idbench.experiments.cli.commands.inner import doubt_window, recording_of, require_window
from idbench.experiments.cli.options.jobs import SearchCommand, Table1Command, Table2Command
from idbench.experiments.cli.saving import folder_of, saved
from idbench.experiments.errors import ExperimentError
from idbench.experiments.paper.job import Searching, TrajectorySearch, table1_of
from idbench.experiments.paper.table1 import print_table1
from idbench.experiments.paper.table2 import Table2, print_table2
from idbench.experiments.results.page import Page, progress_of
from idbench.experiments.results.writing import require_free, write_text
from idbench.identify.files.log_file import write_log
from idbench.sim.robot.robot import Robot
from idbench.sim.scenario.scenario_file import load, to_toml


def compare(options: Table1Command) -> None:
    """Reproduce the comparison."""
    if options.motions is not None:
        _over_motions(options, options.motions)
        return
    folder, page = folder_of(options, options.out or Path("runs/table1")), Page(machine=options.json)
    with options.watching.audience() as audience, closing(page), folder.held():
        with _searching() as told:
            table = table1_of(options, told)
        print_table1(page, table)
        files, hint = {"log.parquet": partial(write_log, table.log)}, options.watching.hint(folder.out)
        with saved(page, folder, table.summary(), files, hint) as attempts:
            if options.watching.rerun:
                from idbench.experiments.recording import comparison_recording

                attempts.recording(lambda: comparison_recording.record_table1(table, audience))


def _over_motions(options: Table1Command, motions: int) -> None:
    """Lay the distribution of errors over random motions beside the paper's."""
    from idbench.experiments.paper.motions import Table1Motions, print_motions

    if options.scenario is not None or options.chain != "all":
        what = "--motions draws motions of its own and compares the paper's chains"
        raise ExperimentError(f"{what}: leave --scenario and --chain out")
    folder = folder_of(options, options.out or Path("runs/table1-motions"), "table1-motions")
    page = Page(machine=options.json)
    with closing(page), folder.held():
        with progress_of("drawing and identifying motions") as progress:
            found = Table1Motions(motions, options.seed or 0, progress=progress)
            print_motions(page, found)
        with saved(page, folder, found.summary(), {}, ""):
            pass


def search(options: SearchCommand) -> None:
    """Search a trajectory."""
    if options.out is not None:
        require_free(options.out, "--out", force=options.force)
    page = Page()
    with closing(page):
        with _searching() as told:
            scenario = TrajectorySearch(options.seed, condition=options.condition or TrajectorySearch.condition).run(
                Robot.load("scara"), told
            )
        if options.out is None:
            page.out(to_toml(scenario).rstrip("\n"))
            return
        write_text(options.out, to_toml(scenario), "--out", force=options.force)
        page.out(f"{options.out}: {scenario.origin}")


@contextmanager
def _searching() -> Iterator[Searching]:
    """Give what shows how far a search for a trajectory is."""
    with Console(stderr=True).status("") as status:
        yield lambda number, distance: status.update(f"searching: round {number}, {distance:.1%} from the paper's Cond(W)")


def table2(options: Table2Command) -> None:
    """Repeat the paper's experiment and attribute its errors."""
    watching, folder = options.watching, folder_of(options, options.out)
    require_window(options.inner, watching)
    page, described = Page(machine=options.json), load(options.scenario)
    with watching.audience() as audience, closing(page), folder.held():
        recording = recording_of(described, audience, options.inner) if watching.rerun else None
        with (
            progress_of("simulating") as progress,
            closing(Table2(described, progress, recording.watch if recording else None)) as table,
        ):
            print_table2(page, table)
            summary = table.summary()
        files = {f"log{i}.parquet": partial(write_log, table.run.alone(i)) for i in range(len(table.run.seeds))}
        with saved(page, folder, summary, files, watching.hint(folder.out)) as attempts:
            if recording:
                from idbench.experiments.recording.comparison_recording import finish_table2

                attempts.recording(lambda: finish_table2(recording, table))
                doubt_window(page, options.inner, recording)
