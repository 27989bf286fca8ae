"""The command that identifies a log."""

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import tyro
from rich.console import Console
from rich.text import Text

from experiments.app import app
from experiments.audience import Audience, Watched, Watching
from experiments.chosen import Asked, Parameters, absolute
from experiments.doubts import doubts_of_result, doubts_of_robot, helpful_moves
from experiments.errors import ExperimentError
from experiments.identified import Identified
from experiments.interruption import importing
from experiments.log_doubts import doubts_of_log
from experiments.page import new_page, shown
from experiments.reading import Delay, Held, file_of, read, told_by
from experiments.results import results_folder, tell_of, write_recording, write_summary
from experiments.subject import CLOSED_FORM, Subject
from experiments.validation import Validated
from experiments.written import Written
from identify import MODELS, IdentificationError, LogError, MotionLog
from identify.log_file import read_columns, write_log
from identify.long import is_long
from sim.robot import Robot

File = Annotated[Path | None, tyro.conf.arg(metavar="FILE")]
Named = Annotated[str | None, tyro.conf.arg(metavar="NAME|FILE")]


@app.command(name="identify")
def identify(  # noqa: PLR0913, PLR0917  # the options of a command
    log: tyro.conf.Positional[Path],
    robot: Named = None,
    torque: Held = None,
    torque_delay: Delay = None,
    chain: str = "idbench",
    model: str = "all",
    estimator: str = "WLS",
    validate: File = None,
    write_mjcf: File = None,
    out: File = None,
    label: str = "",
    parameters: Asked = Parameters(),  # noqa: B008  # frozen
    watching: Watched = Watching(),  # noqa: B008  # frozen
) -> None:
    """Identify a log: CSV or Parquet with the columns t, q1, q2, ..., tau1, tau2, ... in SI units.

    Args:
        log: The file; its times uniform to 1 %. Or the folder of a run, whose recording gets a layer of this identification.
        robot: Name of a robot that ships, or a file that describes it (MJCF or URDF); scara, or that of the run, by default.
        torque: What a torque sample means: held from its sample on for a period (a controller's command), the torque at an
            instant (a measurement), or the mean over a period. Asked for unless the file says it.
        torque_delay: From a sample to the instant it speaks for, in seconds, or `estimate` to find it from the log.
        chain: Signal processing.
        model: all, explicit, implicit or power.
        estimator: OLS, WLS, ...
        validate: A second log, on which the result is judged; without it the last quarter of the first, by a fit of the rest.
        write_mjcf: File to write: the robot's own with the inertias, armatures and frictions that were found, made physically
            consistent (extra `consistent`); those of the first model.
        out: Folder for summary.json, recording.rrd and log.parquet.
        label: What to call this identification in a recording; by default chain and estimator. One of that name is replaced.
        parameters: Which parameters are asked for.
        watching: How it is watched.
    """
    with importing():
        from experiments.tables import print_identified, print_validated

    page, models = new_page(), tuple(MODELS) if model == "all" else (model,)
    path, said = file_of(log), told_by(log)
    _require_label(label)
    subject = Subject(said.get("robot", CLOSED_FORM) if robot is None else absolute(robot), parameters)
    _require_target(write_mjcf, subject)
    named = Identified((), subject, models=models, chain=chain, estimator=estimator, name=label)  # complains of names first
    known, about_delay = read(path, torque, torque_delay, named)
    found = replace(named, logs=(known,), truth=_truth(said, named))
    validated = _validated(found, validate, known if torque or torque_delay else None)
    doubts = _doubts(validated)
    with watching.audience() as audience, shown(page):
        with _explained(subject, known, doubts):
            print_identified(page, found, str(log))
            print_validated(page, validated)
        _say(page, [*doubts, *doubts_of_result(found)])
        if about_delay:
            page.print(about_delay)
        if out is not None:
            _write_results(page, out, log.name, validated, watching, audience)
        elif log.is_dir() and watching.rerun and not is_long(known):
            _add_layer(page, log, found, watching, audience)
        elif audience and not is_long(known):
            _show(found, audience)
        if write_mjcf is not None:
            _write_mjcf(page, found, write_mjcf)


def _add_layer(page: Console, folder: Path, found: Identified, watching: Watching, audience: Audience | None) -> None:
    from experiments.recording.identified import add_layer

    with results_folder(folder) as hidden:
        lost = write_recording(hidden, add_layer(folder, found, audience))
    tell_of(lost, folder)
    page.print(f"added to the recording in {folder}{watching.hint(folder)}", soft_wrap=True)


def _show(found: Identified, audience: Audience) -> None:
    from experiments.recording.identified import record_log

    for _, stream in record_log(found, audience):
        stream.close()


def _require_label(label: str) -> None:
    if label and (not re.fullmatch(r"[A-Za-z0-9][\w.-]*", label) or label == "inner"):
        raise ExperimentError(f"--label {label!r} must be of letters, digits, dots, hyphens and underscores, and not 'inner'")


def _require_target(target: Path | None, subject: Subject) -> None:
    """Raise ExperimentError if the robot cannot be written there; before the work, not after it."""
    if target is None:
        return
    if target.suffix != ".xml":
        raise ExperimentError(f"--write-mjcf {target}: its name must end with .xml, or nothing would read it back")
    if target.is_dir() or not target.absolute().parent.is_dir():
        raise ExperimentError(f"--write-mjcf {target}: there is no folder {target.parent} for it, or it is a folder itself")
    if target.exists() and target.samefile(Robot.path(subject.name)):
        raise ExperimentError(f"--write-mjcf {target} is the robot's own file: choose another name")


def _doubts(validated: Validated) -> list[str]:
    """Return what is suspicious about the robot's file and the logs."""
    subject, second = validated.found.subject, validated.second
    found = [*doubts_of_log(validated.found.logs[0], subject.tree), *doubts_of_robot(subject.robot)]
    return found + ([f"{validated.name}: {doubt}" for doubt in doubts_of_log(second, subject.tree)] if second else [])


def _truth(said: dict[str, Any], named: Identified) -> dict[str, float] | None:
    """Return the truth that the summary of a run states, if it is of the same parameters."""
    truth: dict[str, float] | None = said.get("truth")
    return truth if truth and tuple(truth) == named.basis.parameters else None


def _validated(found: Identified, second: Path | None, said: MotionLog | None) -> Validated:
    """Return the identification, to be judged on a second log: its torque is that of the first if options say it."""
    if second is None:
        return Validated(found)
    path = file_of(second)
    try:
        columns = read_columns(path).ordered(found.subject.robot.joints)
        channel = said.torque if said else columns.torque or found.logs[0].torque
        return Validated(found, MotionLog.at_times(columns.t, columns.q, columns.tau, channel), str(second))
    except LogError as error:
        raise ExperimentError(f"--validate {path}: {error}") from error


@contextmanager
def _explained(subject: Subject, log: MotionLog, doubts: Sequence[str]) -> Iterator[None]:
    """Add to what goes wrong what is suspicious about the log, and which moves would help."""
    try:
        yield
    except IdentificationError as error:
        told = [str(error), *helpful_moves(error, subject, log), *(f"doubtful: {doubt}" for doubt in doubts)]
        raise ExperimentError("; ".join(told)) from error


def _say(page: Console, doubts: Sequence[str]) -> None:
    for doubt in doubts:
        page.print(Text(f"doubtful: {doubt}"), soft_wrap=True)


def _write_mjcf(page: Console, found: Identified, path: Path) -> None:
    written = Written(found, next(iter(found.estimates)))
    written.write(path)
    page.print(Text(f"written to {path}: the robot with the parameters of the {written.model} model"), soft_wrap=True)
    _say(page, written.doubts)


def _write_results(
    page: Console, out: Path, name: str, validated: Validated, watching: Watching, audience: Audience | None
) -> None:
    lost, found = "", validated.found
    with results_folder(out) as folder:
        write_log(found.logs[0], folder / "log.parquet")
        summary = {"experiment": "identify", "log": name, **found.summary(), "validation": validated.summary()}
        write_summary(folder / "summary.json", summary)
        if is_long(found.logs[0]):
            page.print("not recorded: the rows of so long a log are not kept; identify a part of it to look inside")
        elif watching.rerun:
            from experiments.recording.identified import record_log

            lost = write_recording(folder, record_log(found, audience))
    tell_of(lost, out)
    page.print(f"written to {out}{watching.hint(out)}", soft_wrap=True)
