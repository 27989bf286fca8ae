"""The command that simulates a scenario."""

from contextlib import closing
from dataclasses import replace
from functools import partial
from pathlib import Path
from shlex import quote

from rich.text import Text

from idbench.experiments.cli.command import command_of, with_own_parts
from idbench.experiments.cli.commands.inner import doubt_window, recording_of, require_window
from idbench.experiments.cli.options.jobs import RunCommand
from idbench.experiments.cli.saving import Files, folder_of, saved, write_scenario
from idbench.experiments.identification.log_warnings import warnings_of_log
from idbench.experiments.identification.robot_model import SCARA
from idbench.experiments.identification.scenario_run import ScenarioRun
from idbench.experiments.judgement.warnings import FILE, LOG, MODEL, warnings_of_robot
from idbench.experiments.plugin_tables import plugin_conflicts
from idbench.experiments.program import program
from idbench.experiments.reports.printed import print_fit
from idbench.experiments.results.page import Page, stages_of
from idbench.experiments.study.one_run import run_of
from idbench.identify.files.log_file import write_log
from idbench.sim.drives import ServoDrive
from idbench.sim.scenario.scenario import Scenario


def run(options: RunCommand) -> None:
    """Simulate a scenario, identify it, save and record it."""
    page, watching = Page(machine=options.json), options.watching
    made = run_of(with_own_parts(options), lambda said: page.print(Text(said), soft_wrap=True))
    require_window(options.inner, watching)
    name = made.scenario.name
    folder = folder_of(options, options.out or Path("runs") / name)
    made.require_bearable(options.yes)
    with watching.audience() as audience, closing(page), folder.held():
        robot_model = made.request.robot_model
        recording = recording_of(made.scenario, audience, options.inner, robot_model) if watching.rerun else None
        with stages_of(name) as told:
            watch = recording.watch if recording else None
            ran = replace(made, progress=lambda share: told(f"simulating, {share:.0%}", share), watch=watch)
            fit = ran.fit
        answer = ran.conclusion(quote(str(folder.out)))
        if isinstance(ran.scenario.drive, ServoDrive):
            answer = replace(answer, step=_as_servos(ran.scenario, folder.out))
        answer.show(page)
        _print_run(page, ran, verbose=options.verbose)
        summary = ran.summary() | {"conclusion": answer.summary()}
        with saved(page, folder, summary, _files(ran), watching.hint(folder.out)) as attempts:
            if recording:
                attempts.recording(lambda: recording.finish(ran, answer.markdown(command_of(options))))
                doubt_window(page, options.inner, recording)
                if fit.logs.long:
                    page.print("the identification is not recorded: the rows of such a long log are not kept")


def _files(ran: ScenarioRun) -> Files:
    """Writers of log and scenario, and of servos, if there are any, by the names of files."""
    drive, robot = ran.scenario.drive, ran.run.robots[0]
    files: Files = {"log.parquet": partial(write_log, ran.run.alone()), "scenario.toml": partial(write_scenario, ran.scenario)}
    if not isinstance(drive, ServoDrive):
        return files
    from idbench.experiments.servo.identification import servo_toml, write_commands  # half a second that others do not need

    known = {"servo.toml": lambda path: path.write_text(servo_toml(drive, robot))}
    return {**files, **known, "commands.csv": partial(write_commands, ran.run, robot)}


def _as_servos(scenario: Scenario, out: Path) -> str:
    """Return the command that identifies the servos of a run."""
    words = f"{quote(str(out / 'log.parquet'))} --robot {quote(scenario.robot)} --servo {quote(str(out / 'servo.toml'))}"
    return f"{program()} servo {words} needs no torques, which here are those of the motors' currents"


def _print_run(page: Page, ran: ScenarioRun, *, verbose: bool) -> None:
    """Print the estimates, of the paper's robot those of all models, and what to check."""
    whole = tuple(ran.fit.estimates)[: None if ran.scenario.robot == SCARA else 1]
    print_fit(page, ran.fit, f"Scenario {ran.scenario.name}", whole, verbose=verbose)
    if ran.rejection is not None:
        page.print(Text(ran.rejection.words(ran.run.robots[0].joints, ran.scenario.wdyn)), soft_wrap=True)
    of_log = warnings_of_log(ran.run.alone(), ran.fit.robot_model.tree)
    causes = [cause.advice for cause in ran.fit.diagnosis or ()]
    page.warn({LOG: of_log, FILE: [*warnings_of_robot(ran.run.robots[0]), *plugin_conflicts()], MODEL: causes})
