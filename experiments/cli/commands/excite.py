"""The command that designs motions."""

from collections.abc import Callable
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from idbench.experiments.cli.command import command_of, with_own_parts
from idbench.experiments.cli.options.jobs import Excite
from idbench.experiments.cli.saving import Files, folder_of, saved, write_scenario
from idbench.experiments.excite.excited import Excited
from idbench.experiments.excite.job import MotionSequence, designed, excited, write_motion
from idbench.experiments.judgement.warnings import FILE, warnings_of_robot
from idbench.experiments.program import program
from idbench.experiments.recording.audience import Audience
from idbench.experiments.reports.excite import print_excited, print_sequence, report
from idbench.experiments.results.page import Page, progress_of
from idbench.identify.files.log_file import write_log
from idbench.sim.limits.motion_limits import looser

if TYPE_CHECKING:
    from idbench.experiments.results.attempts import Streams


def excite(options: Excite) -> None:
    """Design a motion, or a sequence of them, save and show it."""
    stem, design = Path(options.robot).stem, designed(with_own_parts(options))
    command, page = command_of(options, out=True), Page(machine=options.json)
    folder = folder_of(options, options.out or Path("runs") / f"excited-{stem}")
    with options.watching.audience() as audience, closing(page), folder.held():
        with progress_of(f"designing a motion of {stem}") as progress:
            found, sequence = excited(with_own_parts(options), progress)
            print_excited(page, found)
        robot = design.robot_model.robot
        page.warn({FILE: warnings_of_robot(robot), "limits": looser(robot, design.asked)})
        if sequence:
            print_sequence(page, sequence)
        what, hint = command.removeprefix(f"{program()} excite "), options.watching.hint(folder.out)
        summary = found.summary() | {"path": what} | (sequence.summary() if sequence else {})
        with saved(page, folder, summary, _files(found, sequence), hint) as attempts:
            attempts.file("report.html", lambda: report(found, command))
            if options.watching.rerun:
                attempts.recording(lambda: _recorded(found, audience))
        page.print(f"try it on the simulated robot: {program()} run {folder.out / 'scenario.toml'}", soft_wrap=True)


def _files(found: Excited, sequence: MotionSequence | None) -> Files:
    """Writers of motions, logs and scenario, by the names of files."""
    files = dict[str, Callable[[Path], object]]()
    for number, each in enumerate(sequence.rounds if sequence else (), 1):
        files[f"log{number}.parquet"] = partial(write_log, each.log)
        files[f"motion{number}.csv"] = partial(write_motion, each.excited)
    return files | {"motion.csv": partial(write_motion, found), "scenario.toml": partial(write_scenario, found.scenario)}


def _recorded(found: Excited, audience: Audience | None) -> "Streams":
    from idbench.experiments.recording.excite_recording import record_excited

    return record_excited(found, audience)
