"""The command that identifies a log."""

import re
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.text import Text

from experiments.cli.logs import Identify
from experiments.cli.page import Page, new_page, shown
from experiments.cli.reading import Question, file_of, read, stated_by
from experiments.errors import ExperimentError, ResultsError
from experiments.identification.consistent_robot import Written
from experiments.identification.identification_text import print_identified, print_validated
from experiments.identification.identified import Identified
from experiments.identification.log_warnings import warnings_of_log
from experiments.identification.results import Place, beside, results_folder, tell_of, write_recording, write_summary
from experiments.identification.subject import CLOSED_FORM, Subject, absolute
from experiments.identification.validated import Validated
from experiments.identification.verdict import Remedies, Verdict
from experiments.identification.warnings import (
    DELAY,
    FILE,
    LOG,
    MODEL,
    MOTION,
    helpful_moves,
    warnings_of_result,
    warnings_of_robot,
)
from experiments.plugin_tables import plugin_conflicts
from experiments.recording.audience import Audience, Watching
from identify import MODELS, ExcitationError, IdentificationError, LogError, MotionLog
from identify.data.log_file import write_log
from identify.rows.long_logs import is_long
from sim.errors import BenchError
from sim.robot.robot import Robot

MOST_STARTS = 1000
"""Instants of a log that are looked at for the beginning of another."""


def identify(asked: Identify) -> None:
    """Identify a log, judge the result, write it."""
    page, models, out = new_page(machine=asked.json), tuple(MODELS) if asked.model == "all" else (asked.model,), asked.out
    path, stated = file_of(asked.log), stated_by(asked.log)
    _require_label(asked.label)
    subject = Subject(stated.get("robot", CLOSED_FORM) if asked.robot is None else absolute(asked.robot), asked.parameters)
    _require_target(asked.write_mjcf, subject)
    place = None if out is None else Place(out, "identify", str(asked.log.absolute()), asked.force)
    if place:
        place.check()
    named = Identified(  # complains of names first
        (), subject, models=models, chain=asked.chain, estimator=asked.estimator, name=asked.label
    )
    question = Question(asked.torque, asked.torque_delay, asked.unwrap)
    with ExitStack() as stack:
        audience, path = _followed(stack, asked, path, question, named)
        known, about_delay = read(path, question, named)
        found, hidden = _shown(replace(named, logs=(known,), truth=_truth(stated, named)))
        validated = _validated(found, asked, known)
        of_file = [*warnings_of_robot(found.subject.robot), *plugin_conflicts()]
        warnings = {LOG: _warnings(validated), FILE: of_file, MOTION: hidden}
        audience = audience or stack.enter_context(asked.watching.audience())
        stack.enter_context(shown(page))
        with _explained([warning for group in warnings.values() for warning in group]):
            print_identified(page, found, str(asked.log))
            print_validated(page, validated)
        _warn(page, warnings, warnings_of_result(found), _advice(validated, asked))
        if about_delay:
            page.print(about_delay)
        page.found |= _summary(validated, asked.log.absolute())
        if place is not None:
            _write_results(page, place, validated, asked.watching, audience)
        elif asked.log.is_dir() and asked.watching.rerun and not is_long([known]):
            _add_layer(page, asked.log, found, asked.watching, audience)
        elif audience and not is_long([known]):
            _show(found, audience)
        if asked.write_mjcf is not None:
            _write_mjcf(page, found, asked.write_mjcf)


def _followed(
    stack: ExitStack, asked: Identify, path: Path, question: Question, named: Identified
) -> tuple[Audience | None, Path]:
    """Follow the log, if that is asked for, until it is complete; return who watches, and where the complete log is."""
    if asked.follow is None:
        return None, path
    if not 0 < asked.follow < float("inf"):
        raise ExperimentError(f"--follow {asked.follow:g} must be above 0: for how long [s] a complete log has not grown")
    from experiments.cli.follow import Follower

    audience = stack.enter_context(asked.watching.audience())
    follower = Follower(path, question, named, audience)
    follower.follow(asked.follow)
    return audience, follower.complete(Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="idbench-"))))


def _shown(found: Identified) -> tuple[Identified, list[str]]:
    """Return the identification of what the log shows, and notes on what it does not show."""
    notes = []
    leading = next(iter(found.outcomes.values()))
    while isinstance(leading, ExcitationError) and leading.hidden and len(leading.hidden) < len(found.basis.names):
        moves = helpful_moves(found.subject, found.logs[0], leading.hidden)
        notes.append(
            f"this log does not show {', '.join(leading.hidden)}: left out, as if zero{f' ({moves})' if moves else ''}"
        )
        fewer = replace(found.subject.asked, without=(*found.subject.asked.without, *leading.hidden))
        subject = Subject(found.subject.name, fewer)
        truth = None if found.truth is None else {name: found.truth[name] for name in subject.basis.names}
        found = replace(found, subject=subject, truth=truth)
        leading = next(iter(found.outcomes.values()))
    return found, notes


def _advice(validated: Validated, asked: Identify) -> dict[str, list[str]]:
    """Return what the log says of the delay, and what is most likely to mend a result that is not good."""
    try:
        good = "good" in {Verdict(validated, model).word for model in validated.torques}
    except IdentificationError:
        return {}
    if is_long(validated.found.logs):
        return {}
    remedies = Remedies(validated)
    # Friction takes a wrong delay in, and the verdict may be good: the log itself is asked.
    delay = list(remedies.delay()) if asked.torque_delay != "estimate" else []
    return {DELAY: delay, MODEL: [] if good else list(remedies.options())}


def _add_layer(page: Page, folder: Path, found: Identified, watching: Watching, audience: Audience | None) -> None:
    from experiments.recording.identification_recording import add_layer

    with beside(folder) as hidden:
        lost = write_recording(hidden, add_layer(folder, found, audience))
    tell_of(lost, folder)
    page.print(f"added to the recording in {folder}{watching.hint(folder)}", soft_wrap=True)


def _show(found: Identified, audience: Audience) -> None:
    from experiments.recording.identification_recording import record_log

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


def _warnings(validated: Validated) -> list[str]:
    """Return what is suspicious about the logs."""
    subject, second = validated.found.subject, validated.second
    found = warnings_of_log(validated.found.logs[0], subject.tree)
    return found + ([f"{validated.name}: {warning}" for warning in warnings_of_log(second, subject.tree)] if second else [])


def _truth(stated: dict[str, Any], named: Identified) -> dict[str, float] | None:
    """Return the truth that the summary of a run states, if it is of the same parameters."""
    truth: dict[str, float] | None = stated.get("truth")
    return truth if truth and tuple(truth) == named.basis.names else None


def _validated(found: Identified, asked: Identify, known: MotionLog) -> Validated:
    """Return the identification, to be judged on a second log: its torque is that of the first if options say it."""
    if asked.validate is None:
        return Validated(found)
    path = file_of(asked.validate)
    stated = known.torque if asked.torque or asked.torque_delay else None
    try:
        second, _ = read(path, Question(unwrap=asked.unwrap, otherwise=stated, fallback=known.torque), found)
    except (LogError, ExperimentError) as error:
        raise ExperimentError(f"--validate {error}" if str(path) in str(error) else f"--validate {path}: {error}") from error
    if _within(second, known):
        raise ExperimentError(f"--validate {path} holds the motion that is identified: give one that it has not seen, or none")
    return Validated(found, second, str(asked.validate))


def _within(one: MotionLog, other: MotionLog) -> bool:
    """Return whether a log is a part of another, or the other of it."""
    short, long = sorted((one, other), key=lambda log: log.samples)
    starts = np.flatnonzero((long.q[: long.samples - short.samples + 1] == short.q[0]).all(axis=1)) if short.n == long.n else ()
    return any(np.array_equal(long.q[k : k + short.samples], short.q) for k in starts[:MOST_STARTS])


@contextmanager
def _explained(warnings: Sequence[str]) -> Iterator[None]:
    """Add to what goes wrong what is suspicious about the log."""
    try:
        yield
    except IdentificationError as error:
        raise ExperimentError("; ".join([str(error), *(f"warning: {warning}" for warning in warnings)])) from error


def _warn(page: Page, *groups: Mapping[str, Sequence[str]]) -> None:
    """Print warnings of several sources, the log first, as what comes first may be what makes the others."""
    page.warn({about: [w for group in groups for w in group.get(about, ())] for about in (LOG, DELAY, FILE, MOTION, MODEL)})


def _write_mjcf(page: Page, found: Identified, path: Path) -> None:
    """Write the robot's file; raise ResultsError if that fails, which takes nothing else away."""
    try:
        written = Written(found, next(iter(found.estimates)))
        written.write(path)
    except (IdentificationError, BenchError) as error:
        raise ResultsError(f"--write-mjcf {path}: {error}; everything else is as printed") from error
    page.print(Text(f"written to {path}: the robot with the parameters of the {written.model} model"), soft_wrap=True)
    page.warn({"the file that was written": written.warnings})


def _write_results(page: Page, place: Place, validated: Validated, watching: Watching, audience: Audience | None) -> None:
    lost, found = "", validated.found
    with results_folder(place) as folder:
        write_log(found.logs[0], folder / "log.parquet")
        write_summary(folder / "summary.json", _summary(validated, Path(place.of)))
        if is_long(found.logs):
            page.print("not recorded: the rows of so long a log are not kept; identify a part of it to look inside")
        elif watching.rerun:
            from experiments.recording.identification_recording import record_log

            lost = write_recording(folder, record_log(found, audience))
    tell_of(lost, place.out)
    page.print(f"written to {place.out}{watching.hint(place.out)}", soft_wrap=True)


def _summary(validated: Validated, log: Path) -> dict[str, Any]:
    """Return what a summary.json says of an identification."""
    found = {"experiment": "identify", "log": log.name, "path": str(log)}
    return {**found, **validated.found.summary(), "validation": _judged(validated)}


def _judged(validated: Validated) -> dict[str, Any]:
    """Return what a summary.json says of a validation, verdicts included; why, if there is none."""
    try:
        stated = validated.summary()
    except IdentificationError as error:
        return {"on": validated.title, "models": {}, "failure": str(error)}
    verdicts = {model: Verdict(validated, model).summary() for model in stated["models"]}
    return {**stated, "models": {model: {**verdicts[model], **numbers} for model, numbers in stated["models"].items()}}
