"""Commands that simulate."""

from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from rich.text import Text

from experiments.cli.bench import Run
from experiments.cli.page import Page, new_page, shown
from experiments.cli.paper import Table2 as Repeated
from experiments.cli.progress import progress_of
from experiments.errors import ExperimentError
from experiments.identification.identification_text import print_identified
from experiments.identification.results import Place, results_folder, tell_of, write_recording, write_summary
from experiments.identification.scenario_run import ScenarioRun
from experiments.identification.subject import Subject, absolute
from experiments.identification.warnings import FILE, warnings_of_robot
from experiments.paper.table2 import Table2
from experiments.paper.table2_text import print_table2
from experiments.plugin_tables import plugin_conflicts
from experiments.recording.audience import Audience, Watching
from identify.files.log_file import write_log
from identify.rows.long_logs import is_long
from sim.drives import IdealDrive
from sim.errors import RobotError
from sim.robot.robot import Robot
from sim.scenario.ripple import Ripple
from sim.scenario.scenario import Scenario
from sim.scenario.scenario_file import load, to_toml
from sim.trajectories import Quintic

if TYPE_CHECKING:
    from experiments.recording.identification_recording import RunRecording


def run(asked: Run) -> None:
    """Simulate a scenario, identify it and record it."""
    page, watching, inner = new_page(machine=asked.json), asked.watching, asked.inner
    if asked.scenario is None:
        if asked.robot is not None:
            raise ExperimentError(f"--robot {asked.robot}: a run of a study is of the study's robot")
        made = _again(page, asked.study, asked.index, asked.method)
        made = replace(made, parameters=asked.parameters)
    else:
        described = _with_robot(page, load(_alone(asked.scenario, asked.study, asked.index)), asked.robot)
        made = ScenarioRun(described, asked.chain, asked.estimator, parameters=asked.parameters)
    made = replace(made, start=asked.start, consistent=asked.consistent)
    _require_window(inner, watching)
    described, lost = made.scenario, ""
    place = Place(asked.out or Path("runs") / described.name, "run", described.name, asked.force)
    place.check()
    made.require_bearable(asked.yes)
    with watching.audience() as audience, shown(page):
        with results_folder(place) as folder, progress_of(f"simulating {described.name}") as progress:
            recording = _recording(described, audience, inner, made.subject) if watching.rerun else None
            ran = replace(made, progress=progress, watch=recording.watch if recording else None)
            print_identified(page, ran.identified, f"Scenario {described.name}")
            page.warn({FILE: [*warnings_of_robot(ran.run.robots[0]), *plugin_conflicts()]})
            write_log(ran.run.alone(), folder / "log.parquet")
            (folder / "scenario.toml").write_text(to_toml(described))
            page.found |= ran.summary() | {"folder": str(place.out)}
            write_summary(folder / "summary.json", ran.summary())
            if recording:
                lost = write_recording(folder, recording.finish(ran))
        tell_of(lost, place.out)
        _doubt_window(page, inner, recording)
        if recording and is_long([ran.run.alone()]):
            page.print("the identification is not recorded: the rows of so long a log are not kept")
        page.print(f"written to {place.out}{watching.hint(place.out)}", soft_wrap=True)


def _with_robot(page: Page, scenario: Scenario, robot: str | None) -> Scenario:
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


def _doubt_window(page: Page, inner: tuple[float, float] | None, recording: "RunRecording | None") -> None:
    if inner is not None and recording is not None and recording.base.inner is None:
        page.print(
            f"warning: nothing lies inside the loop from {inner[0]:g} to {inner[1]:g} s: the drive has no currents, "
            "or the run is shorter",
            soft_wrap=True,
        )


def _recording(
    scenario: Scenario,
    audience: Audience | None,
    window: tuple[float, float] | None = None,
    subject: Subject | None = None,
) -> "RunRecording":
    from experiments.recording.identification_recording import RunRecording

    return RunRecording(scenario, audience, window, subject)


def _alone(scenario: str, study: Path | None, index: int | None) -> str:
    if study is not None or index is not None:
        raise ExperimentError(f"{scenario} and --from or --index: name a scenario, or a run of a study")
    return scenario


def _again(page: Page, folder: Path | None, index: int | None, method: int | None) -> ScenarioRun:
    """Return a run of a study, whose rows come out again, to be identified by one of its methods."""
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
    words = [*chosen.names, *(f"{s.axis.field} {s.label}" for s in chosen.settings)]
    page.print(Text(f"shown: method {number} of the study's {len(methods)}: {', '.join(words)}"), soft_wrap=True)
    for reason in dict.fromkeys(row["failure"] for row in rows if row["failure"]):
        page.print(Text(f"warning: {reason}"), soft_wrap=True)
    scenario = replace(store.study.scenario_of(index), name=f"{store.study.name}-{index}")
    return ScenarioRun(scenario, *chosen.names, method=(chosen.chain, chosen.estimator))


def table2(asked: Repeated) -> None:
    """Repeat the paper's experiment and attribute its errors."""
    watching, place = asked.watching, Place(asked.out, "table2", force=asked.force)
    _require_window(asked.inner, watching)
    place.check()
    page, described, lost = new_page(machine=asked.json), load(asked.scenario), ""
    with watching.audience() as audience, shown(page):
        with results_folder(place) as folder, progress_of("simulating") as progress:
            recording = _recording(described, audience, asked.inner) if watching.rerun else None
            with closing(Table2(described, progress, recording.watch if recording else None)) as table:
                print_table2(page, table)
                for i in range(len(table.run.seeds)):
                    write_log(table.run.alone(i), folder / f"log{i}.parquet")
                page.found |= table.summary() | {"folder": str(asked.out)}
                write_summary(folder / "summary.json", table.summary())
                if recording:
                    from experiments.recording.table2_recording import finish_table2

                    lost = write_recording(folder, finish_table2(recording, table))
        tell_of(lost, asked.out)
        _doubt_window(page, asked.inner, recording)
        page.print(f"written to {asked.out}{watching.hint(asked.out)}", soft_wrap=True)
