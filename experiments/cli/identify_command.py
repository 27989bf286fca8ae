"""The command that identifies a log."""

import re
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from rich.text import Text

from experiments.cli.identify_logs import FitLogs, fit_logs, judged_on, question_of, titles, with_chain
from experiments.cli.identify_results import Results, require_targets, summary_of, warn
from experiments.cli.logs import Identify
from experiments.cli.mounting import mounting_of
from experiments.cli.page import Page, new_page, shown
from experiments.cli.reading import Question, file_of, stated_by
from experiments.errors import ExperimentError
from experiments.identification.friction_choice import summary, with_suitable_friction, words
from experiments.identification.identification_text import print_identified, print_validated
from experiments.identification.identified import Identified
from experiments.identification.log_warnings import warnings_of_log
from experiments.identification.results import Place, beside, tell_of, write_recording
from experiments.identification.simulators import require_start
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
from identify import MODELS, AbstractEstimator, ExcitationError, IdentificationError
from identify.judge.friction_choice import FrictionChoice
from identify.rows.long_logs import is_long
from sim.scenario.scenario import Scenario
from sim.scenario.scenario_file import load


def identify(asked: Identify) -> None:
    """Identify logs, judge the result, write it."""
    page, out = new_page(machine=asked.json), asked.out
    _require_logs(asked)
    first = asked.log[0]
    path, stated = file_of(first), stated_by(first)
    named = _named(asked, stated)
    place = None if out is None else Place(out, "identify", str(first.absolute()), asked.force)
    if place:
        place.check()
    with ExitStack() as stack:
        audience, path = _followed(stack, asked, path, question_of(asked), named)
        fit = fit_logs(replace(asked, log=(path, *asked.log[1:])), named)
        whole = replace(fit.named, logs=fit.logs, log_names=fit.names, truth=_truth(stated, named))
        whole, choice = with_friction(whole)
        found, hidden = _shown(whole)
        judged, said = judged_on(asked, found, fit)
        audience = audience or stack.enter_context(asked.watching.audience())
        stack.enter_context(shown(page))
        warned = _printed(page, asked, judged, fit, hidden)
        friction = words(choice, found.subject.laws.names, found.subject.robot.joints) if choice else []
        notes = [*_notes(fit), *fit.notes, *friction, *said]
        for note in notes:
            page.print(Text(note), soft_wrap=True)
        compared = {"friction": summary(choice)} if choice else {}
        page.found |= {**summary_of(judged, first.absolute()), "notes": notes, **compared}
        results = Results(page, asked, found, judged, fit, warned, notes, compared)
        if place is not None:
            results.write(place, audience)
        elif first.is_dir() and asked.watching.rerun and not is_long(found.logs):
            _add_layer(page, first, found, asked.watching, audience)
        elif audience and not is_long(found.logs):
            _show(found, audience)
        results.export()


def _named(asked: Identify, stated: Mapping[str, Any]) -> Identified:
    """Return what is asked for, of no log yet: it complains of names before anything is computed."""
    _require_label(asked.label)
    robot = stated.get("robot", CLOSED_FORM) if asked.robot is None else absolute(asked.robot)
    subject = Subject(robot, asked.parameters, mounting_of(asked.mounting))
    require_targets(asked, subject)
    named = Identified(
        (), subject, models=tuple(MODELS) if asked.model == "all" else (asked.model,), chain=asked.chain,
        estimator=asked.estimator, name=asked.label, loops=_loops(asked), start=asked.start, consistent=asked.consistent,
    )  # fmt: skip
    _require_used(asked, named.solver)
    return with_chain(asked, named)


def _require_used(asked: Identify, solver: AbstractEstimator) -> None:
    """Raise ExperimentError if a loop or a start is given that would not be used."""
    if asked.loop and "loop" not in solver.needs:
        raise ExperimentError(f"--loop: {asked.estimator} simulates no loop; leave it out, or take IV, DIDIM, CLIE or CLOE")
    require_start(asked.start, asked.estimator, solver)


def _printed(
    page: Page, asked: Identify, judged: Sequence[Validated], fit: FitLogs, hidden: Sequence[str]
) -> Mapping[str, Sequence[str]]:
    """Print estimates, verdicts and warnings; return the warnings."""
    found = judged[0].found
    of_file = [*warnings_of_robot(found.subject.robot), *plugin_conflicts()]
    warnings = {LOG: _warnings(judged, fit), FILE: of_file, MOTION: [*hidden]}
    with _explained([warning for group in warnings.values() for warning in group]):
        print_identified(page, found, titles(asked.log))
        for validated in judged:
            print_validated(page, validated)
    return warn(page, warnings, warnings_of_result(found), _advice(judged[0], asked))


def _loops(asked: Identify) -> tuple[Scenario, ...]:
    """Return the closed loops of the logs: those that are named, or that of the run whose folder is given."""
    own = asked.log[0] / "scenario.toml"
    named = asked.loop or ([str(own)] if len(asked.log) == 1 and own.is_file() else [])
    return tuple(map(load, named))


def with_friction(whole: Identified) -> tuple[Identified, FrictionChoice | None]:
    """Return the identification with laws of friction that suit its logs, where that is asked for, and what was compared."""
    return with_suitable_friction(whole) if whole.subject.laws.auto else (whole, None)


def _require_logs(asked: Identify) -> None:
    if not asked.log:
        raise ExperimentError("name a log, or several of one fit")
    twice = [str(path) for k, path in enumerate(asked.log) if path.absolute() in [p.absolute() for p in asked.log[:k]]]
    if twice:
        raise ExperimentError(f"{', '.join(twice)} is given twice: it would count twice")
    if asked.follow is not None and len(asked.log) > 1:
        raise ExperimentError("--follow takes one log, not several")


def _notes(fit: FitLogs) -> list[str]:
    """Return what was done to the logs; by the name of the log, where there are several."""
    several = len(fit.read) > 1
    said = [(f"{read.path.name}: " if several else "") + note for read in fit.read for note in read.notes]
    return list(dict.fromkeys(said))


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
        subject = replace(found.subject, asked=fewer)
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


def _warnings(judged: Sequence[Validated], fit: FitLogs) -> list[str]:
    """Return what is suspicious about the logs."""
    tree, several = judged[0].found.subject.tree, len(fit.logs) > 1
    every = [(f"{name}: " if several else "", log) for name, log in zip(fit.names, fit.logs, strict=True)]
    every += [(f"{validated.name}: ", validated.second) for validated in judged if validated.second]
    return [before + warning for before, log in every for warning in warnings_of_log(log, tree)]


def _truth(stated: dict[str, Any], named: Identified) -> dict[str, float] | None:
    """Return the truth that the summary of a run states, if it is of the same parameters."""
    truth: dict[str, float] | None = stated.get("truth")
    return truth if truth and tuple(truth) == named.basis.names else None


@contextmanager
def _explained(warnings: Sequence[str]) -> Iterator[None]:
    """Add to what goes wrong what is suspicious about the log."""
    try:
        yield
    except IdentificationError as error:
        raise ExperimentError("; ".join([str(error), *(f"warning: {warning}" for warning in warnings)])) from error
