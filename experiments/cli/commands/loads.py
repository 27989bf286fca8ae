"""The commands that identify payloads and gains of drives."""

from collections.abc import Iterator
from contextlib import closing, contextmanager, nullcontext
from pathlib import Path

import numpy as np
from rich.text import Text

from idbench.experiments.cli.command import command_of, with_own_parts
from idbench.experiments.cli.options.jobs import IdentifyGains, IdentifyPayload
from idbench.experiments.cli.saving import folder_of, require_targets, save_summary
from idbench.experiments.errors import ExperimentError
from idbench.experiments.inputs import files_of
from idbench.experiments.loads.job import LoadFit, gains_of, payload_of
from idbench.experiments.loads.known_load import negative_mass
from idbench.experiments.loads.loads_text import body_of
from idbench.experiments.results.attempts import Attempts
from idbench.experiments.results.folder import ResultsFolder
from idbench.experiments.results.page import NOT_SAVED, Page, stages_of
from idbench.experiments.results.writing import write_text
from idbench.sim.robot.rewrite import with_body


def payload(options: IdentifyPayload) -> None:
    """Identify what the gripper holds."""
    require_targets(options.write, [".xml"], force=options.force, read=files_of(options))
    with _page(options) as (page, folder):
        made = payload_of(with_own_parts(options))
        with _identified(page, folder, options, made) as attempts:
            for path in options.write:
                attempts.attempt("--write", lambda path=path: _write(page, options, path, made))  # type: ignore[misc]


def gains(options: IdentifyGains) -> None:
    """Identify the gains of drives."""
    with _page(options) as (page, folder), _identified(page, folder, options, gains_of(with_own_parts(options))):
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
            document.conclusion.show(page)
        made.show(page)
        if document is not None:
            page.print(Text("how well one robot with one payload explains each log:"), soft_wrap=True)
            for _, line in document.verdicts:
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
