"""The command that simulates a scenario."""

from dataclasses import replace
from functools import partial
from pathlib import Path
from shlex import quote

from rich.text import Text

from idbench.experiments.cli.command_text import command_of
from idbench.experiments.cli.commands.inner import doubt_window, recording_of, require_window
from idbench.experiments.cli.options.run import Run
from idbench.experiments.cli.page import Page, new_page, shown, stages_of
from idbench.experiments.cli.saving import Files, saved, write_scenario
from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.log_warnings import warnings_of_log
from idbench.experiments.identification.parameters import Parameters
from idbench.experiments.identification.request import Request
from idbench.experiments.identification.robot_model import RobotModel, absolute
from idbench.experiments.identification.scenario_run import ScenarioRun
from idbench.experiments.judgement.warnings import FILE, LOG, warnings_of_robot
from idbench.experiments.plugin_tables import plugin_conflicts
from idbench.experiments.reports.estimates import shown_whole
from idbench.experiments.reports.printed import print_fit
from idbench.experiments.results.folder import ResultsFolder
from idbench.experiments.servo.identification import servo_toml, write_commands
from idbench.experiments.study.axis import Method, of_currents
from idbench.identify import CHAINS
from idbench.identify.files.log_file import write_log
from idbench.sim.drives import IdealDrive, ServoDrive
from idbench.sim.errors import RobotError
from idbench.sim.robot.robot import Robot
from idbench.sim.scenario.ripple import Ripple
from idbench.sim.scenario.scenario import Scenario
from idbench.sim.scenario.scenario_file import load
from idbench.sim.trajectories import Quintic

LEFT_OUT = ("out", "force", "json", "watching", "yes")
"""Options that make no difference to a run's results."""


def run(options: Run) -> None:
    """Simulate a scenario, identify it, save and record it."""
    page, watching = new_page(machine=options.json), options.watching
    made = _described(page, options)
    require_window(options.inner, watching)
    name = made.scenario.name
    command = command_of("run", options, "scenario", LEFT_OUT, absolute=True)
    folder = ResultsFolder(options.out or Path("runs") / name, "run", command, options.force, _read(options))
    folder.check()
    made.require_bearable(options.yes)
    with watching.audience() as audience, shown(page), folder.held():
        robot_model = made.request.robot_model
        recording = recording_of(made.scenario, audience, options.inner, robot_model) if watching.rerun else None
        with stages_of(name) as told:
            watch = recording.watch if recording else None
            ran = replace(made, progress=lambda share: told(f"simulating, {share:.0%}", share), watch=watch)
            _ = ran.fit
        _print_run(page, ran)
        if isinstance(ran.scenario.drive, ServoDrive):
            page.print(Text(_as_servos(ran.scenario, folder.out)), soft_wrap=True)
        with saved(page, folder, ran.summary(), _files(ran), watching.hint(folder.out)) as attempts:
            if recording:
                attempts.recording(lambda: recording.finish(ran))
                doubt_window(page, options.inner, recording)
                if ran.fit.logs.long:
                    page.print("the identification is not recorded: the rows of such a long log are not kept")


def _files(ran: ScenarioRun) -> Files:
    """Return what writes the log and the scenario, and what is known of servos, if there are any."""
    drive, robot = ran.scenario.drive, ran.run.robots[0]
    files: Files = {"log.parquet": partial(write_log, ran.run.alone()), "scenario.toml": partial(write_scenario, ran.scenario)}
    if not isinstance(drive, ServoDrive):
        return files
    known = {"servo.toml": lambda path: path.write_text(servo_toml(drive, robot))}
    return {**files, **known, "commands.csv": partial(write_commands, ran.run, robot)}


def _as_servos(scenario: Scenario, out: Path) -> str:
    """Return the command that identifies the servos of a run."""
    words = f"{quote(str(out / 'log.parquet'))} --robot {quote(scenario.robot)} --servo {quote(str(out / 'servo.toml'))}"
    return f"the torque above is that of the motors' currents; from commands and positions alone: uv run idbench servo {words}"


def _read(options: Run) -> tuple[Path, ...]:
    """Return the files that are read."""
    named = [options.scenario, options.robot]
    return tuple(Path(name).absolute() for name in named if name is not None and Path(name).suffix)


def _described(page: Page, options: Run) -> ScenarioRun:
    """Return what is to be simulated, and how it is identified."""
    if options.scenario is None:
        if options.robot is not None:
            raise ExperimentError(f"--robot {options.robot}: a run of a study is of the study's robot")
        scenario, method = _again(page, options.study, options.index, options.method)
        names, name = method.names, f"{'-'.join(method.names)}-study"
        chosen, parameters = (method.chain, method.estimator), Parameters(friction=tuple(method.friction.split()))
        if options.parameters != Parameters():
            raise ExperimentError("--from: which parameters are identified is the study's; leave --friction and the like out")
    else:
        scenario = _with_robot(page, load(_alone(options.scenario, options.study, options.index)), options.robot)
        names, name, chosen = (CHAINS.load(options.chain), options.estimator), "", None
        parameters = options.parameters
    robot_model = RobotModel(scenario.robot, parameters)
    request = Request(
        robot_model,
        chain=names[0],
        estimator=names[1],
        method=chosen,
        name=name,
        start=options.start,
        consistent=options.consistent,
    )
    return ScenarioRun(scenario, request)


def _print_run(page: Page, ran: ScenarioRun) -> None:
    """Print the estimates, and what to check."""
    print_fit(page, ran.fit, f"Scenario {ran.scenario.name}", shown_whole(ran.fit, asked=False))
    of_log = warnings_of_log(ran.run.alone(), ran.fit.robot_model.tree)
    page.warn({LOG: of_log, FILE: [*warnings_of_robot(ran.run.robots[0]), *plugin_conflicts()]})


def _with_robot(page: Page, scenario: Scenario, robot: str | None) -> Scenario:
    """Return a scenario with another robot, and moves that fit it."""
    if robot is None:
        return scenario
    other = replace(scenario, robot=absolute(robot), name=f"{scenario.name}-{Path(robot).stem}")
    if isinstance(scenario.trajectory, Quintic) and Robot.load(robot).n != Robot.load(scenario.robot).n:
        page.print(f"the trajectory of {scenario.name} does not fit robot {robot}: the random moves of scenario arm are used")
        other = replace(other, trajectory=load("arm").trajectory, start=())
    if not other.drive.has_own_motors and not _has_motors(robot):
        page.print(f"robot {robot} has no motors (dcmotor elements of MJCF): its drives are ideal, without ripple")
        other = replace(other, drive=IdealDrive(), ripple=Ripple())
    return other


def _has_motors(robot: str) -> bool:
    try:
        return Robot.load(robot).motors is not None
    except RobotError:
        return False


def _alone(scenario: str, study: Path | None, index: int | None) -> str:
    if study is not None or index is not None:
        raise ExperimentError(f"{scenario} and --from or --index: name a scenario, or a run of a study")
    return scenario


def _again(page: Page, folder: Path | None, index: int | None, method: int | None) -> tuple[Scenario, Method]:
    """Return the scenario of a run of a study, which is reproduced, and the method by which it is identified."""
    from idbench.experiments.study.run_study import compare_again
    from idbench.experiments.study.store import Store

    if folder is None or index is None:
        raise ExperimentError("name a scenario, as idbench scenario lists them, or a run of a study: --from DIR --index N")
    store = Store.open(folder)
    number, methods = method or 0, store.study.methods
    if not 0 <= number < len(methods):
        raise ExperimentError(f"--method {number} does not exist: the study has methods 0 to {len(methods) - 1}")
    chosen = of_currents(methods[number]) if store.study.of_servos else methods[number]
    rows, known = compare_again(store, index)
    page.print(
        f"run {index} of {folder}: all {len(rows)} rows are the same again, bit for bit"
        if known
        else f"run {index} of {folder}, which the study has not finished yet"
    )
    words = [*chosen.names, *(f"{s.axis.field} {s.label}" for s in chosen.settings)]
    page.print(Text(f"shown: method {number} of the study's {len(methods)}: {', '.join(words)}"), soft_wrap=True)
    for reason in dict.fromkeys(row["failure"] for row in rows if row["failure"]):
        page.print(Text(f"warning: {reason}"), soft_wrap=True)
    return replace(store.study.scenario_of(index), name=f"{store.study.name}-{index}"), chosen
