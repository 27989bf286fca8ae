"""The commands about Table 1: the comparison, and the search for its trajectory."""

from pathlib import Path

from rich.console import Console

from experiments.cli.page import new_page, show, shown
from experiments.cli.paper import Search as Searched
from experiments.cli.paper import Table1 as Compared
from experiments.cli.progress import progress_of
from experiments.errors import ExperimentError
from experiments.identification.results import Place, results_folder, tell_of, write_recording, write_summary, write_whole
from experiments.paper.motions import Table1Motions
from experiments.paper.motions_report import picture, print_motions
from experiments.paper.search import Search
from experiments.paper.table1 import CHAINS_COMPARED, SCENARIO, Table1
from experiments.paper.table1_text import print_table1
from identify.files.log_file import write_log
from sim.robot.robot import Robot
from sim.scenario.scenario import Scenario
from sim.scenario.scenario_file import load, to_toml


def compare(asked: Compared) -> None:
    """Reproduce the comparison."""
    if asked.seed is not None and asked.scenario is not None:
        raise ExperimentError(f"--seed {asked.seed} and --scenario {asked.scenario} name two trajectories: give one")
    if asked.motions is not None:
        _over_motions(asked, asked.motions)
        return
    chains = CHAINS_COMPARED if asked.chain == "all" else (asked.chain,)
    place = Place(asked.out or Path("runs/table1"), "table1", force=asked.force)
    place.check()
    page, lost = new_page(machine=asked.json), ""
    with asked.watching.audience() as audience, shown(page):
        with results_folder(place) as folder:
            table = Table1(load(asked.scenario or SCENARIO) if asked.seed is None else _searched(asked.seed), chains)
            print_table1(page, table)
            write_log(table.log, folder / "log.parquet")
            page.found |= table.summary() | {"folder": str(place.out)}
            write_summary(folder / "summary.json", table.summary())
            if asked.watching.rerun:
                from experiments.recording.table1_recording import record_table1

                lost = write_recording(folder, record_table1(table, audience))
        tell_of(lost, place.out)
        page.print(f"written to {place.out}{asked.watching.hint(place.out)}", soft_wrap=True)


def _over_motions(asked: Compared, motions: int) -> None:
    """Lay the distribution of errors over random motions beside the paper's."""
    if asked.scenario is not None or asked.chain != "all":
        raise ExperimentError(
            "--motions draws motions of its own and compares the paper's chains: leave --scenario and --chain out"
        )
    place = Place(asked.out or Path("runs/table1-motions"), "table1-motions", force=asked.force)
    page = new_page(machine=asked.json)
    place.check()
    with shown(page):
        with results_folder(place) as folder, progress_of("drawing and identifying motions") as progress:
            found = Table1Motions(motions, asked.seed or 0, progress=progress)
            print_motions(page, found)
            (folder / "motions.png").write_bytes(picture(found))
            page.found |= found.summary() | {"folder": str(place.out)}
            write_summary(folder / "summary.json", found.summary())
        page.print(f"written to {place.out}: the picture is motions.png", soft_wrap=True)


def search(asked: Searched) -> None:
    """Search a trajectory."""
    scenario, page = _searched(asked.seed), new_page()
    text = to_toml(scenario)
    if asked.out is not None:
        write_whole(asked.out, text)
    page.out(f"{asked.out}: {scenario.origin}" if asked.out is not None else text.rstrip("\n"))
    show(page)


def _searched(seed: int) -> Scenario:
    with Console(stderr=True).status("searching a trajectory ...") as status:
        return Search(seed=seed).run(
            Robot.load("scara"),
            lambda number, distance: status.update(f"searching: round {number}, {distance:.1%} from the paper's Cond(W)"),
        )
