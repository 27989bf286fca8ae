"""The commands that identify payloads and gains of drives."""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.text import Text

from experiments.cli.loads import IdentifyGains, IdentifyPayload, LoadOptions
from experiments.cli.mounting import mounting_of
from experiments.cli.page import Page, new_page, shown
from experiments.cli.progress import progress_of
from experiments.cli.reading import Question, ReadLog, file_of, read, with_delays
from experiments.errors import ExperimentError
from experiments.identification.chain_settings import with_cutoff
from experiments.identification.friction_choice import with_suitable_friction, words
from experiments.identification.identified import Identified
from experiments.identification.results import Place, results_folder, write_summary, write_whole
from experiments.identification.subject import Subject, absolute
from experiments.loads.known_load import known_of
from experiments.loads.loads_text import body_of, gains_summary, payload_summary, print_gains, print_payloads
from experiments.loads.simulated import Pairs, Score
from experiments.text import new_table, print_titled
from identify import Array, IdentificationError
from identify.judge.band import Band
from identify.loads.drive_gains import identify_drive_gains
from identify.loads.loaded_robot import LoadedRobot
from identify.loads.payload import WAYS, Payload, with_known_robot
from sim.robot.rewrite import with_body
from sim.scenario.scenario_file import load

RUNS = 20
"""Simulated pairs of runs."""


def payload(asked: IdentifyPayload) -> None:
    """Identify what the gripper holds."""
    page, place = new_page(machine=asked.json), _place(asked, "payload")
    if asked.write_mjcf is not None and asked.write_mjcf.suffix != ".xml":
        raise ExperimentError(f"--write-mjcf {asked.write_mjcf}: its name must end with .xml")
    with shown(page):
        if asked.simulate is not None:
            _compare_ways(page, asked)
        else:
            _identify_payload(page, asked)
        _write(page, place)


def gains(asked: IdentifyGains) -> None:
    """Identify the gains of drives."""
    page, place = new_page(machine=asked.json), _place(asked, "gains")
    with shown(page):
        if asked.simulate is not None:
            _try_gains(page, asked)
        else:
            _identify_gains(page, asked)
        _write(page, place)


def _identify_payload(page: Page, asked: IdentifyPayload) -> None:
    if asked.before is not None and asked.unloaded:
        raise ExperimentError("--before and --unloaded both say what the robot is: give one")
    robot, named, notes = _loaded(asked)
    if asked.before is not None:
        names, X, C = _before(asked.before)
        found: dict[str, Payload | str] = {"fixed": with_known_robot(robot, names, X, C)}
    else:
        found = _by_ways(robot, asked)
    print_payloads(page, found, named.subject.robot.joints[-1])
    for note in notes:
        page.print(Text(note), soft_wrap=True)
    page.found |= {"experiment": "payload", "path": str(asked.log[0].absolute()), "log": asked.log[0].name}
    page.found |= {"robot": named.subject.name, **payload_summary(found)}
    if asked.write_mjcf is not None:
        _write_mjcf(page, asked.write_mjcf, named.subject, next(p for p in found.values() if isinstance(p, Payload)))


def _by_ways(robot: LoadedRobot, asked: IdentifyPayload) -> dict[str, Payload | str]:
    """Return the payload by the ways that are asked for, or why one has none; raise if none has."""
    if not robot.without:
        raise ExperimentError("give logs without the payload (--unloaded), or the robot as it was identified before (--before)")
    found = dict[str, Payload | str]()
    for way in WAYS if asked.way == "all" else (asked.way,):
        try:
            found[way] = WAYS[way](robot)
        except IdentificationError as error:
            found[way] = str(error)
    if not any(isinstance(each, Payload) for each in found.values()):
        raise ExperimentError(str(next(iter(found.values()))))
    return found


def _write_mjcf(page: Page, path: Path, subject: Subject, found: Payload) -> None:
    """Write the robot's file with the payload as a body."""
    body = body_of(found)
    if "mass" not in body:
        raise ExperimentError(f"--write-mjcf {path}: {body['why']}")
    write_whole(
        path,
        with_body(
            subject.name, "payload", np.array(list(body["parameters"].values())), path.absolute().parent, subject.mounting
        ),
    )
    page.print(Text(f"written to {path}: the robot with the payload as a body of its last link"), soft_wrap=True)


def _identify_gains(page: Page, asked: IdentifyGains) -> None:
    robot, named, notes = _loaded(asked)
    found = identify_drive_gains(robot)
    given = np.broadcast_to(robot.loaded[0].torque.gain, (robot.tree.n,)).tolist()
    joints = named.subject.robot.joints
    page.warn({"the gains": print_gains(page, found, given, joints)})
    told = " ".join(
        f"{g:.5g}" if t else f"{given[j]:.5g}" for j, (g, t) in enumerate(zip(found.gains, found.shown, strict=True))
    )
    page.print(Text(f"to read logs with them: --gain {told}"), soft_wrap=True)
    for note in notes:
        page.print(Text(note), soft_wrap=True)
    page.found |= {"experiment": "gains", "path": str(asked.log[0].absolute()), "log": asked.log[0].name}
    page.found |= {"robot": named.subject.name, **gains_summary(found, given, joints)}


def _loaded(asked: LoadOptions) -> tuple[LoadedRobot, Identified, list[str]]:
    """Return the robot with its logs, how these were read, and what was done to them."""
    if not asked.log:
        raise ExperimentError("name the logs with the payload, or --simulate SCENARIO")
    if asked.robot is None:
        raise ExperimentError("--robot is missing: the file that describes the arm, or the name of one that ships")
    known = known_of(asked.known.mass, asked.known.at, asked.known.inertia)
    subject = Subject(absolute(asked.robot), asked.parameters, mounting_of(asked.mounting))
    named = Identified((), subject, models=("explicit",), estimator=asked.estimator)
    question = Question(asked.torque, asked.torque_delay, columns=asked.reading)
    every = [read(file_of(path), question, named) for path in (*asked.unloaded, *asked.log)]
    named = _with_band(named, asked.cutoff, every)
    if asked.torque_delay == "estimate":
        every = with_delays(every, named)
    without, loaded = (_logs(some) for some in (every[: len(asked.unloaded)], every[len(asked.unloaded) :]))
    notes = [f"{one.path.name}: {note}" for one in every for note in one.notes]
    if subject.laws.auto:
        found, choice = with_suitable_friction(replace(named, logs=without or loaded))
        notes += words(choice, found.subject.laws.names, subject.robot.joints)
        named = replace(named, subject=found.subject)
    subject = named.subject
    robot = LoadedRobot(subject.tree, subject.grouping.standard, without, loaded, named.processing, named.solver, known)
    return robot, named, notes


def _logs(every: Sequence[ReadLog]) -> tuple[Any, ...]:
    return tuple(log for one in every for log in one.logs)


def _with_band(named: Identified, cutoff: float | None, every: Sequence[ReadLog]) -> Identified:
    """Return the identification with the band that is asked for, or that the logs need."""
    least = named.processing.operator.cutoff  # type: ignore[attr-defined]  # of this chain
    own = Band.of([log for one in every for log in one.logs], len(named.basis.names) + 10, least).cutoff
    chain = with_cutoff(named.processing, cutoff or max(own, least))
    return replace(named, method=(chain, named.solver))


def _before(path: Path) -> tuple[tuple[str, ...], Array, Array]:
    """Return names, values and covariance of base parameters in a file."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        parameters = content["parameters"]
        names = tuple(str(p["name"]) for p in parameters)
        X, C = np.array([float(p["value"]) for p in parameters]), np.array(content["covariance"], dtype=np.float64)
        if C.shape != (len(names),) * 2 or any(p["column"] is None for p in parameters):
            raise ValueError("no base parameters with their covariance")
    except OSError as error:
        raise ExperimentError(f"--before {path}: {error.strerror}") from error
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise ExperimentError(
            f"--before {path} holds no base parameters of an arm ({error}): make it by idbench identify ... --write FILE.json"
        ) from error
    return names, X, C


def _pairs(asked: LoadOptions) -> Pairs:
    if asked.log or asked.unloaded:
        raise ExperimentError("--simulate needs no logs: leave them out")
    scenario = load(str(asked.simulate))
    if asked.robot is not None:
        scenario = replace(scenario, robot=absolute(asked.robot))
    return Pairs(scenario, RUNS if asked.runs is None else asked.runs, asked.parameters)


def _compare_ways(page: Page, asked: IdentifyPayload) -> None:
    """Print how well each way finds the payload of a simulated robot."""
    pairs = _pairs(asked)
    with progress_of("payload") as told:
        scores = pairs.payloads(told)
    _print_scores(page, scores, f"{pairs.scenario.name}: payload of {pairs.scenario.payload.mass:g} kg, {pairs.runs} runs")
    page.found |= {"experiment": "payload", "path": pairs.scenario.name, "ways": {k: _summary(s) for k, s in scores.items()}}


def _try_gains(page: Page, asked: IdentifyGains) -> None:
    """Print how well gains of a simulated robot are found."""
    pairs = _pairs(asked)
    known = {"ML": pairs.truth["ML"]}
    with progress_of("gains") as told:
        score = pairs.gains(known, told)
    _print_scores(
        page, {"gains": score}, f"{pairs.scenario.name}: gains from a payload of {known['ML']:g} kg, {pairs.runs} runs"
    )
    page.found |= {"experiment": "gains", "path": pairs.scenario.name, **_summary(score)}


def _print_scores(page: Page, scores: dict[str, Score], title: str) -> None:
    """Print rms errors, coverage and time."""
    names = next((score.names for score in scores.values() if score.names), ())
    grid = new_table("", [f"{way}\n{what}" for way in scores for what in ("bias", "rms")])
    for i, name in enumerate(names):
        cells = (f"{x[i]:.2g}" for s in scores.values() if s.names for x in (s.bias, s.rms))
        grid.add_row(name, *cells)
    grid.add_section()
    grid.add_row("within 2 sigma", *(c for s in scores.values() if s.names for c in ("", f"{100 * s.coverage:.1f} %")))
    grid.add_row("s a run", *(c for s in scores.values() if s.names for c in ("", f"{s.seconds:.2g}")))
    print_titled(page, title, grid, 1)
    for way, score in scores.items():
        for why in dict.fromkeys(score.failures):
            page.print(Text(f"{way}: {score.failures.count(why)} runs without an estimate: {why}"), soft_wrap=True)


def _summary(score: Score) -> dict[str, Any]:
    return {
        "parameters": list(score.names),
        "bias": score.bias.tolist() if score.names else [],
        "rms": score.rms.tolist() if score.names else [],
        "within_2_sigma": score.coverage if score.names else None,
        "runs": len(score.z),
        "failures": list(score.failures),
    }


def _place(asked: LoadOptions, experiment: str) -> Place | None:
    of = str(asked.simulate) if asked.simulate else str(asked.log[0].absolute()) if asked.log else ""
    place = None if asked.out is None else Place(asked.out, experiment, of, asked.force)
    if place:
        place.check()
    return place


def _write(page: Page, place: Place | None) -> None:
    if place is None:
        return
    with results_folder(place) as folder:
        write_summary(folder / "summary.json", page.found)
    page.print(f"written to {place.out}", soft_wrap=True)
