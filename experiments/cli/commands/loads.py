"""The commands that identify payloads and gains of drives."""

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from typing import Any

import numpy as np
from rich.text import Text

from idbench.experiments.cli.command import command_of, with_own_parts
from idbench.experiments.cli.options.jobs import IdentifyGains, IdentifyPayload
from idbench.experiments.cli.saving import save_summary
from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.inputs import files_of
from idbench.experiments.loads.job import GainsFit, PayloadFit, gains_of, payload_of, simulated_pairs
from idbench.experiments.loads.known_load import LoadJudgement, negative_mass
from idbench.experiments.loads.loads_text import (
    body_of,
    gains_summary,
    payload_summary,
    print_gains,
    print_payloads,
    words_of_payload,
)
from idbench.experiments.loads.simulated import PairScore
from idbench.experiments.results.attempts import Attempts
from idbench.experiments.results.folder import ResultsFolder
from idbench.experiments.results.page import COLORS, Page, new_page, progress_of, shown, stages_of
from idbench.experiments.results.writing import require_free, write_text
from idbench.experiments.text import new_table, print_titled
from idbench.identify.loads.payload import PayloadEstimate
from idbench.sim.robot.rewrite import with_body

NOT_MADE_AGAIN = ("force", "json", "write_mjcf")  # Options that a report does not name where it says how to make it again


def payload(options: IdentifyPayload) -> None:
    """Identify what the gripper holds."""
    page, folder = new_page(machine=options.json), _folder(options, "payload")
    if (path := options.write_mjcf) is not None:
        if path.suffix != ".xml":
            raise ExperimentError(f"--write-mjcf {path}: its name must end with .xml")
        require_free(path, "--write-mjcf", force=options.force, read=files_of(options))
    with shown(page), folder.held() if folder else nullcontext():
        if options.simulate is not None:
            _compare_ways(page, options)
            _finish(page, folder)
            return
        made = payload_of(with_own_parts(options))
        with _headed(page, made.judgement, made.leading, words_of_payload(made.leading)):
            _print_payload(page, options, made)
        with _finish(page, folder) as attempts:
            _judge(page, made.judgement, made.leading, attempts, folder)
            attempts.file("report.html", lambda: _report(made, command_of("payload", options, "log", NOT_MADE_AGAIN)))
            if options.write_mjcf is not None:
                robot_model = made.judgement.request.robot_model
                attempts.attempt("--write-mjcf", lambda: _write_mjcf(page, options, robot_model, made.leading))


def gains(options: IdentifyGains) -> None:
    """Identify the gains of drives."""
    page, folder = new_page(machine=options.json), _folder(options, "gains")
    with shown(page), folder.held() if folder else nullcontext():
        if options.simulate is not None:
            _try_gains(page, options)
            _finish(page, folder)
            return
        made = gains_of(with_own_parts(options))
        with _headed(page, made.judgement, None, f"gains {' '.join(f'{gain:.4g}' for gain in made.gains)}"):
            _print_gains(page, options, made)
        with _finish(page, folder) as attempts:
            _judge(page, made.judgement, None, attempts, folder)
            attempts.file("report.html", lambda: _report(made, command_of("gains", options, "log", NOT_MADE_AGAIN)))


@contextmanager
def _headed(page: Page, judgement: LoadJudgement, payload: PayloadEstimate | None, found: str) -> Iterator[None]:
    """Print the verdict and what was found in one line, then what follows, whatever ends the judging."""
    head = None
    try:
        with stages_of("judging"):
            word = judgement.word(judgement.warnings(payload))
        head = Text(f"Result: {word}, {found}\n", f"bold {COLORS.get(word, '')}".strip())
    except Exception:  # what judges it again, below, says why
        head = None
    except BaseException:
        yield
        page.show()
        raise
    if head is not None:
        page.print(head, soft_wrap=True)
    yield


def _report(made: PayloadFit | GainsFit, command: str) -> str:
    from idbench.experiments.reports.others import report_of_load

    return report_of_load(made, command)


def _print_payload(page: Page, options: IdentifyPayload, made: PayloadFit) -> None:
    robot_model = made.judgement.request.robot_model
    print_payloads(page, made.found, robot_model.robot.joints[-1])
    for note in made.notes:
        page.print(Text(note), soft_wrap=True)
    page.found |= {"experiment": "payload", "path": str(options.log[0].absolute()), "log": options.log[0].name}
    page.found |= {"robot": robot_model.name, **payload_summary(made.found)}


def _print_gains(page: Page, options: IdentifyGains, made: GainsFit) -> None:
    robot_model, given = made.judgement.request.robot_model, made.given.tolist()
    joints = robot_model.robot.joints
    page.warn({"the gains": print_gains(page, made.found, given, joints)})
    page.print(Text(f"to read logs with them: --gain {' '.join(f'{gain:.5g}' for gain in made.gains)}"), soft_wrap=True)
    for note in made.notes:
        page.print(Text(note), soft_wrap=True)
    page.found |= {"experiment": "gains", "path": str(options.log[0].absolute()), "log": options.log[0].name}
    page.found |= {"robot": robot_model.name, **gains_summary(made.found, given, joints)}


def _judge(
    page: Page, judgement: LoadJudgement, payload: PayloadEstimate | None, attempts: Attempts, folder: ResultsFolder | None
) -> None:
    """Print the verdict, and what to check, and save both."""
    with stages_of("judging"):
        doubts = attempts.attempt("the verdict", lambda: judgement.warnings(payload))
    if doubts is None:
        return
    word = judgement.word(doubts)
    page.print(Text("how well one robot with one payload explains each log:"), soft_wrap=True)
    for name, verdict in judgement.verdicts.items():
        page.print(Text(f"{name}: {verdict.word}: {'; '.join(verdict.reasons)}"), soft_wrap=True)
    page.found |= {"judgement": judgement.summary(word)}
    page.warn(doubts)
    attempts.attempt("summary.json", lambda: save_summary(page, folder))


def _write_mjcf(page: Page, options: IdentifyPayload, robot_model: RobotModel, found: PayloadEstimate) -> None:
    """Write the robot's file with the payload as a body."""
    body, path = body_of(found), options.write_mjcf
    if path is None or "mass" not in body or negative_mass(found):
        raise ExperimentError(f"--write-mjcf {path}: {body.get('why', 'the mass of the payload is below zero')}")
    values = np.array(list(body["parameters"].values()))
    text = with_body(robot_model.name, "payload", values, path.absolute().parent, robot_model.mounting)
    write_text(path, text, "--write-mjcf", force=options.force, read=files_of(options))
    page.print(Text(f"written to {path}: the robot with the payload as a body of its last link"), soft_wrap=True)


def _compare_ways(page: Page, options: IdentifyPayload) -> None:
    """Print how well each way finds the payload of a simulated robot."""
    pairs = simulated_pairs(with_own_parts(options))
    with progress_of("payload") as told:
        scores = pairs.payloads(told)
    _print_scores(page, scores, f"{pairs.scenario.name}: payload of {pairs.scenario.payload.mass:g} kg, {pairs.runs} runs")
    page.found |= {"experiment": "payload", "path": pairs.scenario.name, "ways": {k: _summary(s) for k, s in scores.items()}}


def _try_gains(page: Page, options: IdentifyGains) -> None:
    """Print how well gains of a simulated robot are found."""
    pairs = simulated_pairs(with_own_parts(options))
    known = {"ML": pairs.truth["ML"]}
    with progress_of("gains") as told:
        score = pairs.gains(known, told)
    _print_scores(
        page, {"gains": score}, f"{pairs.scenario.name}: gains from a payload of {known['ML']:g} kg, {pairs.runs} runs"
    )
    page.found |= {"experiment": "gains", "path": pairs.scenario.name, **_summary(score)}


def _print_scores(page: Page, scores: dict[str, PairScore], title: str) -> None:
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


def _summary(score: PairScore) -> dict[str, Any]:
    return {
        "parameters": list(score.names),
        "bias": score.bias.tolist() if score.names else [],
        "rms": score.rms.tolist() if score.names else [],
        "within_2_sigma": score.coverage if score.names else None,
        "runs": len(score.z),
        "failures": list(score.failures),
    }


def _folder(options: IdentifyPayload | IdentifyGains, experiment: str) -> ResultsFolder | None:
    if options.out is None:
        return None
    command = command_of(experiment, options, "log", ("out", *NOT_MADE_AGAIN), absolute=True)
    folder = ResultsFolder(options.out, experiment, command, options.force, files_of(options))
    folder.check()
    return folder


def _finish(page: Page, folder: ResultsFolder | None) -> Attempts:
    """Show and save what was found; return what keeps it while it is shown in other ways."""
    page.show()
    save_summary(page, folder)
    if folder is not None:
        page.print(f"written to {folder.out}", soft_wrap=True)
    return Attempts("the results are printed" + (f", and in {folder.out}" if folder else ""), folder)
