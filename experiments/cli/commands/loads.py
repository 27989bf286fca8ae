"""The commands that identify payloads and gains of drives."""

from collections.abc import Iterator
from contextlib import closing, contextmanager, nullcontext
from pathlib import Path
from typing import Any

import numpy as np
from rich.text import Text

from idbench.experiments.cli.command import command_of, with_own_parts
from idbench.experiments.cli.options.jobs import IdentifyGains, IdentifyPayload
from idbench.experiments.cli.saving import folder_of, require_targets, save_summary
from idbench.experiments.errors import ExperimentError
from idbench.experiments.inputs import files_of
from idbench.experiments.loads.job import LoadFit, gains_of, payload_of, simulated_pairs
from idbench.experiments.loads.known_load import negative_mass
from idbench.experiments.loads.loads_text import body_of
from idbench.experiments.loads.simulated import PairScore
from idbench.experiments.results.attempts import Attempts
from idbench.experiments.results.folder import ResultsFolder
from idbench.experiments.results.page import COLORS, NOT_SAVED, Page, progress_of, stages_of
from idbench.experiments.results.writing import write_text
from idbench.experiments.text import new_table, print_titled
from idbench.sim.robot.rewrite import with_body


def payload(options: IdentifyPayload) -> None:
    """Identify what the gripper holds."""
    require_targets(options.write, [".xml"], force=options.force, read=files_of(options))
    with _page(options) as (page, folder):
        if options.simulate is not None:
            _compare_ways(page, options)
            save_summary(page, folder)
            return
        made = payload_of(with_own_parts(options))
        with _identified(page, folder, options, made) as attempts:
            for path in options.write:
                attempts.attempt("--write", lambda path=path: _write(page, options, path, made))  # type: ignore[misc]


def gains(options: IdentifyGains) -> None:
    """Identify the gains of drives."""
    with _page(options) as (page, folder):
        if options.simulate is not None:
            _try_gains(page, options)
            save_summary(page, folder)
            return
        with _identified(page, folder, options, gains_of(with_own_parts(options))):
            pass


@contextmanager
def _page(options: IdentifyPayload | IdentifyGains) -> Iterator[tuple[Page, ResultsFolder | None]]:
    """Give the page of a command and the folder of its results, and say in the end where they are."""
    page, folder = Page(machine=options.json), folder_of(options, options.out) if options.out else None
    page.found |= {"experiment": options.called}
    with closing(page), folder.held() if folder else nullcontext():
        yield page, folder
        page.print(f"written to {folder.out}" if folder else NOT_SAVED, soft_wrap=True)


@contextmanager
def _identified(
    page: Page, folder: ResultsFolder | None, options: IdentifyPayload | IdentifyGains, made: LoadFit
) -> Iterator[Attempts]:
    """Show and save a fit, its verdict first, whatever ends the judging; give what tries to show it in other ways."""
    page.found |= {"path": str(options.log[0].absolute()), "log": options.log[0].name, **made.content}
    with Attempts("the results are printed" + (f", and in {folder.out}" if folder else ""), folder) as attempts:
        try:
            save_summary(page, folder)
            with stages_of("judging"):
                document = attempts.attempt("the verdict", lambda: made.document)
        except BaseException:  # whatever ends it, what was found is worth keeping
            made.show(page)
            page.show()
            raise
        if document is not None:
            word, first = document.verdicts[0]
            page.print(Text(f"{first}\n", f"bold {COLORS.get(word, '')}".strip()), soft_wrap=True)
        made.show(page)
        if document is not None:
            page.print(Text("how well one robot with one payload explains each log:"), soft_wrap=True)
            for _, line in document.verdicts[1:]:
                page.print(Text(line), soft_wrap=True)
            page.found |= made.summary()
            page.warn(document.warnings)
            page.show()
            attempts.attempt("summary.json", lambda: save_summary(page, folder))
            attempts.file("report.html", lambda: document.page(command_of(options, out=True)))
        yield attempts


def _write(page: Page, options: IdentifyPayload, path: Path, made: LoadFit) -> None:
    """Write the robot's file with the payload as a body."""
    found, robot_model = made.leading, made.judgement.request.robot_model
    assert found is not None
    body = body_of(found)
    if "mass" not in body or negative_mass(found):
        raise ExperimentError(f"--write {path}: {body.get('why', 'the mass of the payload is below zero')}")
    values = np.array(list(body["parameters"].values()))
    text = with_body(robot_model.name, "payload", values, path.absolute().parent, robot_model.mounting)
    write_text(path, text, "--write", force=options.force, read=files_of(options))
    page.print(Text(f"written to {path}: the robot with the payload as a body of its last link"), soft_wrap=True)


def _compare_ways(page: Page, options: IdentifyPayload) -> None:
    """Print how well each way finds the payload of a simulated robot."""
    pairs = simulated_pairs(with_own_parts(options))
    with progress_of("payload") as told:
        scores = pairs.payloads(told)
    _print_scores(page, scores, f"{pairs.scenario.name}: payload of {pairs.scenario.payload.mass:g} kg, {pairs.runs} runs")
    page.found |= {"path": pairs.scenario.name, "ways": {k: _summary(s) for k, s in scores.items()}}


def _try_gains(page: Page, options: IdentifyGains) -> None:
    """Print how well gains of a simulated robot are found."""
    pairs = simulated_pairs(with_own_parts(options))
    mass = pairs.truth["ML"]
    with progress_of("gains") as told:
        score = pairs.gains({"ML": mass}, told)
    _print_scores(page, {"gains": score}, f"{pairs.scenario.name}: gains from a payload of {mass:g} kg, {pairs.runs} runs")
    page.found |= {"path": pairs.scenario.name, **_summary(score)}


def _print_scores(page: Page, scores: dict[str, PairScore], title: str) -> None:
    """Print rms errors, coverage and time."""
    names = next((score.names for score in scores.values() if score.names), ())
    grid = new_table("", [f"{way}\n{what}" for way in scores for what in ("bias", "rms")])
    for i, name in enumerate(names):
        grid.add_row(name, *(f"{x[i]:.2g}" for s in scores.values() if s.names for x in (s.bias, s.rms)))
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
