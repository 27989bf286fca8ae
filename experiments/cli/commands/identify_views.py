"""What shows an identification: report, recording, files for other software; each may fail alone."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.text import Text

from idbench.experiments.cli.options.jobs import Identify
from idbench.experiments.document import Conclusion
from idbench.experiments.errors import ExperimentError, ResultsError
from idbench.experiments.exports.exports import kind_of
from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.judgement.judgement import Judgement
from idbench.experiments.recording.audience import Audience
from idbench.experiments.results.attempts import Attempts
from idbench.experiments.results.folder import RECORDING, ResultsFolder
from idbench.experiments.results.page import NOT_SAVED, Page
from idbench.experiments.results.writing import Manifest, folder_for, write_text


@dataclass(frozen=True, eq=False)
class Shown:
    """An identification that is complete, and where it is shown."""

    page: Page
    """Where files that are written are named."""
    options: Identify
    """What was asked for."""
    command: str
    """The same as it is typed."""
    judgement: Judgement
    """The judged fit."""
    answer: Conclusion
    """The verdict in a sentence, and the next step."""
    warnings: Mapping[str, Sequence[str]]
    """What to check, by what it is about."""
    folder: ResultsFolder | None
    """Where its files go."""
    audience: Audience | None
    """Who watches."""


def report(shown: Shown, attempts: Attempts) -> None:
    """Write the page of the identification."""
    if shown.folder is None or shown.judgement.fit.logs.long:
        return
    from idbench.experiments.reports.page import report as page_of

    text = page_of(shown.judgement, shown.answer, shown.warnings, shown.page.found["notes"], shown.command, attempts)
    shown.folder.add("report.html", text)


def recording(shown: Shown) -> None:
    """Write the recording, or show it to who watches."""
    run, rerun, fit = shown.options.log[0], shown.options.watching.rerun, shown.judgement.fit
    layered = (run / RECORDING).is_file()  # the folder of a run, whose recording gets a layer
    into = shown.folder or (ResultsFolder(run, "run", shown.command, shown.options.force) if layered else None)
    if not rerun or (into is None and shown.audience is None):
        return
    if fit.logs.long:
        shown.page.print("not recorded: the rows of such a long log are not kept; identify a part of it to look inside")
        return
    from idbench.experiments.recording.identification_recording import add_layer, record_log
    from idbench.experiments.results.attempts import write_streams

    alone = shown.folder is not None or into is None
    head = shown.answer.markdown(shown.command)
    write_streams(record_log(fit.on(0), head, shown.audience) if alone else add_layer(run, fit, head, shown.audience), into)
    if len(fit.logs.fitted) > 1:
        shown.page.print(f"recorded: {fit.logs.name(0)}, by the estimate of all logs")
    if into and not shown.folder:
        shown.page.print(f"added to the recording in {run}{shown.options.watching.hint(run)}", soft_wrap=True)


def require_layer(options: Identify, label: str, command: str) -> None:
    """Raise ExperimentError if the layer of another identification would be replaced in the folder of a run."""
    name, run = f"recording.{label}.rrd", options.log[0]
    if not run.is_dir() or options.out or not options.watching.rerun:
        return
    recorded = (run / RECORDING).is_file()
    if not recorded and options.label:
        raise ExperimentError(f"there is no {RECORDING} in {run}, to which --label {label} could add: run it anew")
    if options.force or not recorded:
        return
    there = Manifest.of(run).files.get(name)
    if there is not None and there.command != command and (run / name).is_file():
        holds = f"{run} holds the layer {label!r} of `{there.command}`"
        raise ExperimentError(f"{holds}: choose another --label, or replace it with --force")


def view_all(shown: Shown, attempts: Attempts) -> None:
    """Make every view; those that fail are noted."""
    attempts.attempt("report.html", lambda: report(shown, attempts))
    attempts.attempt("the recording", lambda: recording(shown))
    told = set[str]()
    for path in shown.options.write:
        attempts.attempt(f"--write {path}", lambda path=path: _export(shown, path, told))  # type: ignore[misc]
    out = shown.folder.out if shown.folder else None
    shown.page.print(f"written to {out}{shown.options.watching.hint(out)}" if out else NOT_SAVED, soft_wrap=True)
    shown.page.show()


def _export(shown: Shown, path: Path, told: set[str]) -> None:
    """Write a file for other software, with the parameters of the first model that has an estimate."""
    export, leading = kind_of(path, "--write"), shown.judgement.fit.leading
    made = export.render(shown.judgement.fit, leading, path)
    if path not in made.texts:  # a folder of files
        folder_for(path, "--write")
    for target, text in made.texts.items():
        if shown.folder and shown.folder.goes_beside(target, "--write"):
            shown.folder.add(target.name, text)
        else:
            write_text(target, text, "--write", force=shown.options.force, read=shown.folder.read if shown.folder else ())
    named = ", ".join(map(str, made.texts if path in made.texts else [path]))
    shown.page.print(Text(f"written to {named}: {export.what} with the parameters of the {leading} model"), soft_wrap=True)
    for note in (note for note in made.notes if note not in told):
        shown.page.print(Text(note), soft_wrap=True)
    told.update(made.notes)
    shown.page.warn({"the file that was written": made.warnings})


def require_targets(options: Identify, robot_model: RobotModel, folder: ResultsFolder | None, read: Sequence[Path]) -> None:
    """Raise ExperimentError if what is asked for cannot be written there; before the work, not after it."""
    for path in options.write:
        kind = kind_of(path, "--write")
        if not (folder and folder.goes_beside(path, "--write")):
            kind.require_free(path, "--write", force=options.force, read=read)
        kind.require(robot_model, path)
    targets = [path.absolute() for asked in options.write for path in kind_of(asked, "--write").paths(asked)]
    if twice := next((path for k, path in enumerate(targets) if path in targets[:k]), None):
        raise ResultsError(f"{twice} is to be written twice: give each file a name of its own")
