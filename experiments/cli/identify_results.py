"""What an identification leaves behind: a folder, a robot's files, a page."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rich.text import Text

from experiments.cli.command_text import command_of
from experiments.cli.identify_logs import FitLogs
from experiments.cli.logs import Identify
from experiments.cli.page import Page
from experiments.errors import ExperimentError, ResultsError
from experiments.exports.exports import EXPORTS
from experiments.identification.identified import Identified
from experiments.identification.iterations import iterations
from experiments.identification.results import Place, results_folder, tell_of, write_recording, write_summary
from experiments.identification.subject import Subject
from experiments.identification.validated import Validated
from experiments.identification.verdict import Verdict
from experiments.identification.warnings import DELAY, FILE, LOG, MODEL, MOTION
from experiments.recording.audience import Audience
from identify import IdentificationError
from identify.files.log_file import write_log
from identify.rows.long_logs import is_long
from sim.errors import BenchError
from sim.robot.robot import Robot

LEFT_OUT = ("out", "force", "json", "watching", "write", "write_mjcf", "follow")
"""Options that make no difference to an identification."""


@dataclass(frozen=True, eq=False)
class Results:
    """What an identification leaves behind.

    Parameters
    ----------
    page : Page
        Where it is said.
    asked : Identify
        The options.
    found : Identified
        The identification.
    judged : sequence of Validated
        On each unseen motion.
    fit : FitLogs
        Its logs.
    warned : mapping of str to sequence of str
        Warnings by what they are about.
    notes : sequence of str
        What was done and chosen.
    further : mapping
        What else a summary.json says.
    """

    page: Page
    asked: Identify
    found: Identified
    judged: Sequence[Validated]
    fit: FitLogs
    warned: Mapping[str, Sequence[str]]
    notes: Sequence[str]
    further: Mapping[str, Any] = field(default_factory=dict)

    def write(self, place: Place, audience: Audience | None) -> None:
        """Write the folder: summary, logs, recording, page."""
        lost, found, watching = "", self.found, self.asked.watching
        with results_folder(place) as folder:
            for k, log in enumerate(found.logs):
                write_log(log, folder / f"log{k + 1 if k else ''}.parquet")
            write_summary(
                folder / "summary.json", {**summary_of(self.judged, Path(place.of)), "notes": list(self.notes), **self.further}
            )
            if not is_long(found.logs):
                (folder / "report.html").write_text(self._report(), encoding="utf-8")
            if is_long(found.logs):
                self.page.print("not recorded: the rows of so long a log are not kept; identify a part of it to look inside")
            elif watching.rerun:
                from experiments.recording.identification_recording import record_log

                lost = write_recording(folder, record_log(found.on(0), audience))
        tell_of(lost, place.out)
        if len(found.logs) > 1 and watching.rerun:
            self.page.print(f"recorded: {found.log_names[0]}, by the estimate of all logs")
        self.page.print(f"written to {place.out}{watching.hint(place.out)}", soft_wrap=True)

    def _report(self) -> str:
        """Return the page of the identification."""
        from experiments.identification.identify_report import report

        command = command_of("identify", self.asked, "log", LEFT_OUT)
        return report(self.found, self.judged, self.warned, self.notes, command)

    def export(self) -> None:
        """Write the files that are asked for; raise ResultsError if one fails, which takes nothing else away."""
        failed, leading = list[str](), next(iter(self.found.estimates))
        for path in targets_of(self.asked):
            what, write = EXPORTS[path.suffix]
            try:
                warnings = write(self.found, leading, path)
            except (IdentificationError, BenchError, ExperimentError) as error:
                option = "--write-mjcf" if path == self.asked.write_mjcf else "--write"
                failed.append(f"{option} {path}: {error}" if str(path) not in str(error) else str(error))
                continue
            self.page.print(Text(f"written to {path}: {what} with the parameters of the {leading} model"), soft_wrap=True)
            self.page.warn({"the file that was written": warnings})
        if failed:
            raise ResultsError(f"{'; '.join(failed)}; everything else is as printed")


def targets_of(asked: Identify) -> list[Path]:
    """Return the files that are asked for."""
    return [*([asked.write_mjcf] if asked.write_mjcf else []), *asked.write]


def require_targets(asked: Identify, subject: Subject) -> None:
    """Raise ExperimentError if what is asked for cannot be written there; before the work, not after it."""
    if asked.write_mjcf is not None and asked.write_mjcf.suffix != ".xml":
        raise ExperimentError(f"--write-mjcf {asked.write_mjcf}: its name must end with .xml, or nothing would read it back")
    for target in targets_of(asked):
        if target.suffix not in EXPORTS:
            raise ExperimentError(f"--write {target}: its name must end with {', '.join(EXPORTS)}")
        option = "--write-mjcf" if target == asked.write_mjcf else "--write"
        if target.is_dir() or not target.absolute().parent.is_dir():
            raise ExperimentError(f"{option} {target}: there is no folder {target.parent} for it, or it is a folder itself")
        if target.exists() and target.samefile(Robot.path(subject.name)):
            raise ExperimentError(f"{option} {target} is the robot's own file: choose another name")
        if target.exists() and target != asked.write_mjcf and not asked.force:
            raise ExperimentError(f"{option} {target} exists: choose another name, or replace it with --force")


def warn(page: Page, *groups: Mapping[str, Sequence[str]]) -> dict[str, list[str]]:
    """Print warnings of several sources, the log first, as what comes first may be what makes the others; return them."""
    found = {about: [w for group in groups for w in group.get(about, ())] for about in (LOG, DELAY, FILE, MOTION, MODEL)}
    page.warn(found)
    return found


def summary_of(judged: Sequence[Validated], log: Path) -> dict[str, Any]:
    """Return what a summary.json says of an identification."""
    found = {"experiment": "identify", "log": log.name, "path": str(log)}
    each = [_judged(validated) for validated in judged]
    rounds = {"iterations": iterations(judged[0].found)}
    return {**found, **judged[0].found.summary(), **rounds, "validation": each[0], "validations": each}


def _judged(validated: Validated) -> dict[str, Any]:
    """Return what a summary.json says of a validation, verdicts included; why, if there is none."""
    try:
        stated = validated.summary()
    except IdentificationError as error:
        return {"on": validated.title, "models": {}, "failure": str(error)}
    verdicts = {model: Verdict(validated, model).summary() for model in stated["models"]}
    return {**stated, "models": {model: {**verdicts[model], **numbers} for model, numbers in stated["models"].items()}}
