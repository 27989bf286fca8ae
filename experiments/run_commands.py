"""Commands that simulate."""

import os
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro
from rich.console import Console
from rich.text import Text

from experiments.app import app
from experiments.errors import ExperimentError
from experiments.interruption import importing
from experiments.page import new_page, show
from experiments.results import results_folder, write_summary, write_whole
from identify.log_file import write_log
from sim.engine import Progress
from sim.scenario_file import load, names, to_toml

if TYPE_CHECKING:
    from experiments.run import ScenarioRun

File = Annotated[Path | None, tyro.conf.arg(metavar="FILE")]
Name = Annotated[str | None, tyro.conf.arg(metavar="SCENARIO")]
From = Annotated[Path | None, tyro.conf.arg(name="from", metavar="DIR")]
Index = Annotated[int | None, tyro.conf.arg(metavar="N")]


@app.command(name="run")
def run(  # the options of a command
    scenario: tyro.conf.Positional[Name] = None,
    out: File = None,
    chain: str = "idbench",
    estimator: str = "WLS",
    study: From = None,
    index: Index = None,
    method: Index = None,
) -> None:
    """Simulate a scenario in closed loop, identify it with all models, and record it.

    Args:
        scenario: Name of a scenario that ships, or a file (TOML).
        study: Instead of a scenario: the folder of a study, one run of which is made again.
        index: Number of that run; its rows must come out with the same bits.
        method: Which of the study's combinations of chain, estimator and their settings is shown; the first by default.
        out: Folder for summary.json, recording.rrd, log.parquet and scenario.toml; runs/<name of the scenario> by default.
        chain: Signal processing.
        estimator: OLS, WLS, ...
    """
    os.environ.setdefault("RUST_LOG", "off")  # what goes wrong in rerun we say ourselves, in one line
    with importing():
        from experiments.recording.identified import record_run
        from experiments.run import ScenarioRun
        from experiments.tables import print_identified

    page = new_page()
    made = (
        _again(page, study, index, method)
        if scenario is None
        else ScenarioRun(load(_alone(scenario, study, index)), chain, estimator)
    )
    described = made.scenario
    folder_name = out or Path("runs") / described.name
    with results_folder(folder_name) as folder:
        ran = replace(made, progress=watch(f"simulating {described.name}"))
        print_identified(page, ran.identified, f"Scenario {described.name}")
        page.print(f"written to {folder_name}; see it: uv run idbench view {folder_name}", soft_wrap=True)
        write_log(ran.run.alone(), folder / "log.parquet")
        (folder / "scenario.toml").write_text(to_toml(described))
        record_run(folder / "recording.rrd", ran)
        write_summary(folder / "summary.json", ran.summary())
    show(page)


def _alone(scenario: str, study: Path | None, index: int | None) -> str:
    if study is not None or index is not None:
        raise ExperimentError(f"{scenario} and --from or --index: name a scenario, or a run of a study")
    return scenario


def _again(page: Console, folder: Path | None, index: int | None, method: int | None) -> "ScenarioRun":
    """Return a run of a study, whose rows come out again, to be identified by one of its methods."""
    from experiments.run import ScenarioRun
    from experiments.study.again import compare_again
    from experiments.study.store import Store

    if folder is None or index is None:
        raise ExperimentError("name a scenario, as idbench scenario lists them, or a run of a study: --from DIR --index N")
    store = Store.open(folder)
    number, methods = method or 0, store.study.methods
    if not 0 <= number < len(methods):
        raise ExperimentError(f"--method {number} does not exist: the study has methods 0 to {len(methods) - 1}")
    chosen = methods[number]
    rows, known = compare_again(store, index)
    page.print(
        f"run {index} of {folder}: all {len(rows)} rows come out again, bit for bit"
        if known
        else f"run {index} of {folder}, which the study has not finished yet"
    )
    told = [*chosen.names, *(f"{s.axis.field} {s.label}" for s in chosen.settings)]
    page.print(Text(f"shown: method {number} of the study's {len(methods)}: {', '.join(told)}"), soft_wrap=True)
    for reason in dict.fromkeys(row["failure"] for row in rows if row["failure"]):
        page.print(Text(f"doubtful: {reason}"), soft_wrap=True)
    scenario = replace(store.study.scenario_of(index), name=f"{store.study.name}-{index}")
    return ScenarioRun(scenario, *chosen.names, method=(chosen.chain, chosen.estimator))


@app.command(name="table2")
def table2(out: Path = Path("runs/table2"), scenario: str = "table2") -> None:
    """Repeat the paper's experiment (Table 2) on the virtual robot, and attribute its errors; takes two minutes.

    Args:
        out: Folder for summary.json, recording.rrd and the logs of the realizations.
        scenario: Name of a scenario, or a file (TOML).
    """
    os.environ.setdefault("RUST_LOG", "off")  # what goes wrong in rerun we say ourselves, in one line
    with importing():
        from experiments.recording.table2 import record_table2
        from experiments.table2 import Table2
        from experiments.tables import print_table2

    page, described = new_page(), load(scenario)
    with results_folder(out) as folder:
        table = Table2(described, watch("simulating"))
        print_table2(page, table)
        page.print(f"written to {out}; see it: uv run idbench view {out}", soft_wrap=True)
        for i in range(len(table.run.seeds)):
            write_log(table.run.alone(i), folder / f"log{i}.parquet")
        record_table2(folder / "recording.rrd", table)
        write_summary(folder / "summary.json", table.summary())
    show(page)


@app.command(name="scenario")
def scenario(name: tyro.conf.Positional[Annotated[str | None, tyro.conf.arg(metavar="NAME")]] = None, out: File = None) -> None:
    """Write a scenario out to start from, every setting explained; without a name, list those that ship.

    Args:
        name: Name of a scenario, or a file.
        out: File (TOML) to write; printed if none is given.
    """
    page = new_page()
    if name is None:
        for known in names():
            page.out(f"{known:16} {load(known).origin}")
    elif out is None:
        page.out(to_toml(load(name)).rstrip("\n"))
    elif out.exists():
        raise ExperimentError(f"{out} exists: choose another --out")
    else:
        write_whole(out, to_toml(load(name)))
        page.out(f"written to {out}; run it: uv run idbench run {out}")
    show(page)


def watch(what: str) -> Progress:
    """Return what shows the share that is done on the terminal's error stream, if it is a terminal."""
    console = Console(stderr=True)

    def show_share(share: float) -> None:
        if console.is_terminal:
            console.print(f"{what}: {share:4.0%}", end="\r", highlight=False)

    return show_share
