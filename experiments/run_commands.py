"""Commands that simulate."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro
from rich.console import Console
from rich.text import Text

from experiments.app import app
from experiments.audience import Audience, Watched, Watching, Window
from experiments.chosen import Asked, Parameters, absolute
from experiments.doubts import doubts_of_robot
from experiments.errors import ExperimentError
from experiments.interruption import importing
from experiments.page import new_page, shown
from experiments.results import results_folder, tell_of, write_recording, write_summary
from identify.log_file import write_log
from identify.long import is_long
from sim.drives import IdealDrive
from sim.engine import Progress
from sim.errors import RobotError
from sim.ripple import Ripple
from sim.robot import Robot
from sim.scenario import Scenario
from sim.scenario_file import load, to_toml
from sim.trajectories import Quintic

if TYPE_CHECKING:
    from experiments.recording.identified import RunRecording
    from experiments.run import ScenarioRun

File = Annotated[Path | None, tyro.conf.arg(metavar="FILE")]
Name = Annotated[str | None, tyro.conf.arg(metavar="SCENARIO")]
Named = Annotated[str | None, tyro.conf.arg(metavar="NAME|FILE")]
From = Annotated[Path | None, tyro.conf.arg(name="from", metavar="DIR")]
Index = Annotated[int | None, tyro.conf.arg(metavar="N")]


@app.command(name="run")
def run(  # noqa: PLR0913, PLR0917  # the options of a command
    scenario: tyro.conf.Positional[Name] = None,
    out: File = None,
    chain: str = "idbench",
    estimator: str = "WLS",
    study: From = None,
    index: Index = None,
    method: Index = None,
    inner: Window = None,
    robot: Named = None,
    parameters: Asked = Parameters(),  # noqa: B008  # frozen
    watching: Watched = Watching(),  # noqa: B008  # frozen
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
        inner: From when to when [s] the signals inside the loop are recorded at the full rate of the drive, such as 10 10.5.
        robot: Another robot than the scenario's: name of one that ships, or a file (MJCF or URDF). A trajectory that does not
            fit it is replaced by random moves.
        parameters: Which parameters are identified.
        watching: How it is watched.
    """
    with importing():
        from experiments.run import ScenarioRun
        from experiments.tables import print_identified

    page = new_page()
    if scenario is None:
        if robot is not None:
            raise ExperimentError(f"--robot {robot}: a run of a study is of the study's robot")
        made = replace(_again(page, study, index, method), parameters=parameters)
    else:
        described = _with_robot(page, load(_alone(scenario, study, index)), robot)
        made = ScenarioRun(described, chain, estimator, parameters=parameters)
    _require_window(inner, watching)
    described, lost = made.scenario, ""
    folder_name = out or Path("runs") / described.name
    if (folder_name / "study.toml").exists():
        raise ExperimentError(f"{folder_name} holds a study: choose another --out")
    with watching.audience() as audience, shown(page):
        with results_folder(folder_name) as folder:
            recording = _recording(described, audience, inner) if watching.rerun else None
            ran = replace(made, progress=watch(f"simulating {described.name}"), watch=recording.watch if recording else None)
            print_identified(page, ran.identified, f"Scenario {described.name}")
            for doubt in doubts_of_robot(ran.run.robots[0]):
                page.print(f"doubtful: {doubt}", soft_wrap=True)
            write_log(ran.run.alone(), folder / "log.parquet")
            (folder / "scenario.toml").write_text(to_toml(described))
            write_summary(folder / "summary.json", ran.summary())
            if recording:
                lost = write_recording(folder, recording.finish(ran))
        tell_of(lost, folder_name)
        _doubt_window(page, inner, recording)
        if recording and is_long(ran.run.alone()):
            page.print("the identification is not recorded: the rows of so long a log are not kept")
        page.print(f"written to {folder_name}{watching.hint(folder_name)}", soft_wrap=True)


def _with_robot(page: Console, scenario: Scenario, robot: str | None) -> Scenario:
    """Return a scenario with another robot, and moves that fit it."""
    if robot is None:
        return scenario
    other = replace(scenario, robot=absolute(robot), name=f"{scenario.name}-{Path(robot).stem}")
    if isinstance(scenario.trajectory, Quintic) and Robot.load(robot).n != Robot.load(scenario.robot).n:
        page.print(f"the trajectory of {scenario.name} is none for robot {robot}: it makes the random moves of scenario arm")
        other = replace(other, trajectory=load("arm").trajectory, start=())
    if not isinstance(other.drive, IdealDrive) and not _has_motors(robot):
        page.print(f"robot {robot} has no motors (dcmotor elements of MJCF): its drives are ideal, without ripple")
        other = replace(other, drive=IdealDrive(), ripple=Ripple())
    return other


def _has_motors(robot: str) -> bool:
    try:
        return Robot.load(robot).motors is not None
    except RobotError:
        return False


def _require_window(inner: tuple[float, float] | None, watching: Watching) -> None:
    if inner is not None and not (watching.rerun and 0 <= inner[0] < inner[1]):
        raise ExperimentError(f"--inner {inner[0]:g} {inner[1]:g} must be two times [s], in order, and needs a recording")


def _doubt_window(page: Console, inner: tuple[float, float] | None, recording: "RunRecording | None") -> None:
    if inner is not None and recording is not None and recording.base.inner is None:
        page.print(
            f"doubtful: nothing lies inside the loop from {inner[0]:g} to {inner[1]:g} s: the drive has no currents, "
            "or the run is shorter",
            soft_wrap=True,
        )


def _recording(scenario: Scenario, audience: Audience | None, window: tuple[float, float] | None = None) -> "RunRecording":
    from experiments.recording.identified import RunRecording

    return RunRecording(scenario, audience, window)


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
def table2(
    out: Path = Path("runs/table2"),
    scenario: str = "table2",
    inner: Window = None,
    watching: Watched = Watching(),  # noqa: B008  # frozen
) -> None:
    """Repeat the paper's experiment (Table 2) on the virtual robot, and attribute its errors; takes two minutes.

    Args:
        out: Folder for summary.json, recording.rrd and the logs of the realizations.
        scenario: Name of a scenario, or a file (TOML).
        inner: From when to when [s] the signals inside the loop are recorded at the full rate of the drive, such as 10 10.5.
        watching: How it is watched.
    """
    with importing():
        from experiments.table2 import Table2
        from experiments.tables import print_table2

    _require_window(inner, watching)
    page, described, lost = new_page(), load(scenario), ""
    with watching.audience() as audience, shown(page):
        with results_folder(out) as folder:
            recording = _recording(described, audience, inner) if watching.rerun else None
            table = Table2(described, watch("simulating"), recording.watch if recording else None)
            print_table2(page, table)
            for i in range(len(table.run.seeds)):
                write_log(table.run.alone(i), folder / f"log{i}.parquet")
            write_summary(folder / "summary.json", table.summary())
            if recording:
                from experiments.recording.table2 import finish_table2

                lost = write_recording(folder, finish_table2(recording, table))
        tell_of(lost, out)
        _doubt_window(page, inner, recording)
        page.print(f"written to {out}{watching.hint(out)}", soft_wrap=True)


def watch(what: str) -> Progress:
    """Return what shows the share that is done on the terminal's error stream, if it is a terminal."""
    console = Console(stderr=True)

    def show_share(share: float) -> None:
        if console.is_terminal:
            console.print(f"{what}: {share:4.0%}", end="\r", highlight=False)

    return show_share
