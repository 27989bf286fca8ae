"""The commands that identify payloads and gains of drives."""

import json
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.text import Text

from idbench.experiments.cli.command_text import command_of
from idbench.experiments.cli.commands.requests import read_options
from idbench.experiments.cli.options.loads import IdentifyGains, IdentifyPayload, LoadOptions
from idbench.experiments.cli.page import Page, new_page, progress_of, shown, stages_of
from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.friction_choice import chosen_friction, words
from idbench.experiments.identification.load import in_band, load
from idbench.experiments.identification.reading import file_of
from idbench.experiments.identification.request import Request
from idbench.experiments.identification.robot_model import RobotModel, absolute
from idbench.experiments.loads.judgement import LoadJudgement, negative_mass
from idbench.experiments.loads.known_load import known_of
from idbench.experiments.loads.loads_text import body_of, gains_summary, payload_summary, print_gains, print_payloads
from idbench.experiments.loads.simulated import Pairs, Score
from idbench.experiments.results.attempts import Attempts
from idbench.experiments.results.folder import ResultsFolder
from idbench.experiments.results.writing import require_free, write_summary, write_text
from idbench.experiments.text import new_table, print_titled
from idbench.identify import Array, IdentificationError
from idbench.identify.loads.drive_gains import identify_drive_gains
from idbench.identify.loads.loaded_robot import LETTERS, LoadedRobot
from idbench.identify.loads.payload import WAYS, Payload, with_known_robot
from idbench.sim.robot.rewrite import with_body
from idbench.sim.robot.robot import Robot
from idbench.sim.scenario.scenario_file import load as load_scenario

RUNS = 20
"""Simulated pairs of runs."""


def payload(options: IdentifyPayload) -> None:
    """Identify what the gripper holds."""
    page, folder = new_page(machine=options.json), _folder(options, "payload")
    if (path := options.write_mjcf) is not None:
        if path.suffix != ".xml":
            raise ExperimentError(f"--write-mjcf {path}: its name must end with .xml")
        require_free(path, "--write-mjcf", force=options.force, read=_read(options))
    with shown(page), folder.held() if folder else nullcontext():
        if options.simulate is not None:
            _compare_ways(page, options)
            _finish(page, folder)
            return
        judgement, found = _identify_payload(page, options)
        with _finish(page, folder) as attempts:
            _judge(page, judgement, found, attempts, folder)
            if options.write_mjcf is not None:
                attempts.attempt("--write-mjcf", lambda: _write_mjcf(page, options, judgement.request.robot_model, found))


def gains(options: IdentifyGains) -> None:
    """Identify the gains of drives."""
    page, folder = new_page(machine=options.json), _folder(options, "gains")
    with shown(page), folder.held() if folder else nullcontext():
        if options.simulate is not None:
            _try_gains(page, options)
            _finish(page, folder)
            return
        judgement = _identify_gains(page, options)
        with _finish(page, folder) as attempts:
            _judge(page, judgement, None, attempts, folder)


def _identify_payload(page: Page, options: IdentifyPayload) -> tuple[LoadJudgement, Payload]:
    if options.before is not None and options.unloaded:
        raise ExperimentError("--before and --unloaded both say what the robot is: give one")
    judgement, notes = _loaded(options)
    robot, request = judgement.robot, judgement.request
    if options.before is not None:
        names, X, C = _before(options.before)
        if missing := [name for name in names if name not in robot.robot.names]:
            raise ExperimentError(
                f"--before {options.before} is of another robot, or of other laws of friction: this one has no "
                f"{', '.join(missing[:3])}"
            )
        found: dict[str, Payload | str] = {"fixed": with_known_robot(robot, names, X, C)}
        judgement = replace(judgement, before=dict(zip(names, X.tolist(), strict=True)))
    else:
        found = _by_ways(robot, options)
    print_payloads(page, found, request.robot_model.robot.joints[-1])
    for note in notes:
        page.print(Text(note), soft_wrap=True)
    page.found |= {"experiment": "payload", "path": str(options.log[0].absolute()), "log": options.log[0].name}
    leading = next(p for p in found.values() if isinstance(p, Payload))
    page.found |= {"robot": request.robot_model.name, **payload_summary(found)}
    return judgement, leading


def _judge(
    page: Page, judgement: LoadJudgement, payload: Payload | None, attempts: Attempts, folder: ResultsFolder | None
) -> None:
    """Print the verdict, and what to check, and save both."""
    with stages_of("judging"):
        doubts = attempts.attempt("the verdict", lambda: judgement.warnings(payload))
    if doubts is None:
        return
    word = judgement.word(doubts)
    page.print(Text(f"verdict: {word}; how well one robot with one payload explains each log:"), soft_wrap=True)
    for name, verdict in judgement.verdicts.items():
        page.print(Text(f"{name}: {verdict.word}: {'; '.join(verdict.reasons)}"), soft_wrap=True)
    page.found |= {"judgement": judgement.summary(word)}
    page.warn(doubts)
    attempts.attempt("summary.json", lambda: _save(page, folder))


def _by_ways(robot: LoadedRobot, options: IdentifyPayload) -> dict[str, Payload | str]:
    """Return the payload by the ways that are asked for, or why one has none; raise if none has."""
    if not robot.without:
        raise ExperimentError("give logs without the payload (--unloaded), or the robot as it was identified before (--before)")
    found = dict[str, Payload | str]()
    for way in WAYS if options.way == "all" else (options.way,):
        try:
            found[way] = WAYS[way](robot)
        except IdentificationError as error:
            found[way] = str(error)
    if not any(isinstance(each, Payload) for each in found.values()):
        raise ExperimentError(str(next(iter(found.values()))))
    return found


def _write_mjcf(page: Page, options: IdentifyPayload, robot_model: RobotModel, found: Payload) -> None:
    """Write the robot's file with the payload as a body."""
    body, path = body_of(found), options.write_mjcf
    if path is None or "mass" not in body or negative_mass(found):
        raise ExperimentError(f"--write-mjcf {path}: {body.get('why', 'the mass of the payload is below zero')}")
    values = np.array(list(body["parameters"].values()))
    text = with_body(robot_model.name, "payload", values, path.absolute().parent, robot_model.mounting)
    write_text(path, text, "--write-mjcf", force=options.force, read=_read(options))
    page.print(Text(f"written to {path}: the robot with the payload as a body of its last link"), soft_wrap=True)


def _identify_gains(page: Page, options: IdentifyGains) -> LoadJudgement:
    if options.known.mass is None:
        raise ExperimentError("--mass is missing: the gains follow from a payload whose mass is known")
    judgement, notes = _loaded(options)
    robot, robot_model = judgement.robot, judgement.request.robot_model
    found = identify_drive_gains(robot)
    given = np.broadcast_to(robot.loaded[0].torque.gain, (robot.tree.n,)) * judgement.gain
    found = replace(found, gains=found.gains * judgement.gain, sigma=found.sigma * judgement.gain)
    joints = robot_model.robot.joints
    page.warn({"the gains": print_gains(page, found, given.tolist(), joints)})
    gains = np.where(found.shown, found.gains, given)
    page.print(Text(f"to read logs with them: --gain {' '.join(f'{gain:.5g}' for gain in gains)}"), soft_wrap=True)
    for note in notes:
        page.print(Text(note), soft_wrap=True)
    page.found |= {"experiment": "gains", "path": str(options.log[0].absolute()), "log": options.log[0].name}
    page.found |= {"robot": robot_model.name, **gains_summary(found, given.tolist(), joints)}
    return judgement.with_gains(gains / given)


def _loaded(options: LoadOptions) -> tuple[LoadJudgement, list[str]]:
    """Return the robot with its logs, to be judged, and what was done to them."""
    if not options.log:
        raise ExperimentError("name the logs with the payload, or --simulate SCENARIO")
    if options.robot is None:
        raise ExperimentError("--robot is missing: the file that describes the arm, or the name of one that ships")
    known = known_of(options.known.mass, options.known.at, options.known.inertia)
    robot_model = RobotModel(absolute(options.robot), options.parameters, options.mounting.mounting)
    request = Request(robot_model, models=("explicit",), estimator=options.estimator, mask_speed=options.mask_speed)
    if options.cutoff is not None:
        request = in_band(request, options.cutoff)
    paths, band = (*options.unloaded, *options.log), options.cutoff is None
    loaded = load(paths, read_options(options), request, band=band, more=len(LETTERS))
    request, notes, first = loaded.request, list(loaded.notes), len(options.unloaded)
    without, with_it = loaded.logs(slice(first)), loaded.logs(slice(first, None))
    if robot_model.laws.auto:
        request, choice = chosen_friction(request, without or with_it)
        notes += words(choice, request.robot_model.laws.names, robot_model.robot.joints)
    robot_model = request.robot_model
    standard = robot_model.grouping.standard
    robot = LoadedRobot(robot_model.tree, standard, without, with_it, request.processing, request.solver, known)
    return LoadJudgement(robot, request, loaded.names, np.array(loaded.read[-1].columns.gain or 1.0)), notes


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


def _pairs(options: LoadOptions) -> Pairs:
    if options.log or options.unloaded:
        raise ExperimentError("--simulate needs no logs: leave them out")
    scenario = load_scenario(str(options.simulate))
    if options.robot is not None:
        scenario = replace(scenario, robot=absolute(options.robot))
    return Pairs(scenario, RUNS if options.runs is None else options.runs, options.parameters)


def _compare_ways(page: Page, options: IdentifyPayload) -> None:
    """Print how well each way finds the payload of a simulated robot."""
    pairs = _pairs(options)
    with progress_of("payload") as told:
        scores = pairs.payloads(told)
    _print_scores(page, scores, f"{pairs.scenario.name}: payload of {pairs.scenario.payload.mass:g} kg, {pairs.runs} runs")
    page.found |= {"experiment": "payload", "path": pairs.scenario.name, "ways": {k: _summary(s) for k, s in scores.items()}}


def _try_gains(page: Page, options: IdentifyGains) -> None:
    """Print how well gains of a simulated robot are found."""
    pairs = _pairs(options)
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


def _read(options: LoadOptions) -> tuple[Path, ...]:
    """Return the files that are read."""
    robot = [] if options.robot is None else [Robot.path(options.robot)]
    logs = [file_of(path) for path in (*options.log, *options.unloaded)]
    before = getattr(options, "before", None)
    return (*robot, *logs, *([before] if before else ()))


def _folder(options: LoadOptions, experiment: str) -> ResultsFolder | None:
    if options.out is None:
        return None
    command = command_of(experiment, options, "log", ("out", "force", "json", "write_mjcf"), absolute=True)
    folder = ResultsFolder(options.out, experiment, command, options.force, _read(options))
    folder.check()
    return folder


def _save(page: Page, folder: ResultsFolder | None) -> None:
    if folder is not None:
        with folder.complete() as hidden:
            write_summary(hidden / "summary.json", page.found)


def _finish(page: Page, folder: ResultsFolder | None) -> Attempts:
    """Show and save what was found; return what keeps it while it is shown in other ways."""
    page.show()
    _save(page, folder)
    if folder is not None:
        page.print(f"written to {folder.out}", soft_wrap=True)
    return Attempts("the results are printed" + (f", and in {folder.out}" if folder else ""), folder)
