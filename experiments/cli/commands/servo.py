"""The command that identifies servos."""

from contextlib import closing, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from rich.text import Text

from idbench.experiments.cli.command import command_of
from idbench.experiments.cli.options.jobs import IdentifyServo
from idbench.experiments.cli.saving import folder_of, require_targets, save_summary
from idbench.experiments.document import Document
from idbench.experiments.identification.robot_model import absolute
from idbench.experiments.inputs import files_of
from idbench.experiments.recording.audience import Audience
from idbench.experiments.results.attempts import Attempts
from idbench.experiments.results.folder import ResultsFolder
from idbench.experiments.results.page import NOT_SAVED, Page, stages_of
from idbench.experiments.results.writing import write_text
from idbench.experiments.servo.bam import bam_of
from idbench.experiments.servo.job import ServosFit, servos_identified
from idbench.experiments.servo.joints import Identified
from idbench.experiments.servo.servo_files import for_mujoco, in_mujoco, inexpressible, mjcf_of, servo_function
from idbench.experiments.servo.servo_text import servo_table

if TYPE_CHECKING:
    from idbench.experiments.results.attempts import Streams


def servo(options: IdentifyServo) -> None:
    """Identify servos."""
    page, folder = Page(machine=options.json), folder_of(options, options.out) if options.out else None
    require_targets(options.write, WRITERS, force=options.force, read=files_of(options))
    with options.watching.audience() as audience, closing(page), folder.held() if folder else nullcontext():
        page.found |= {"experiment": "servo", "robot": absolute(str(options.robot)), "friction": options.friction, "joints": {}}
        made, document = _identified(page, folder, options)
        document.conclusion.show(page)
        for table in document.tables:
            table.show(page)
        for line in (*document.notes, *(line for _, line in document.verdicts)):
            page.print(Text(line), soft_wrap=True)
        page.warn(document.warnings)
        page.show()
        save_summary(page, folder)
        with Attempts("the results are printed" + (f", and in {folder.out}" if folder else ""), folder) as attempts:
            attempts.file("report.html", lambda: document.page(command_of(options, out=True)))
            for path in options.write:
                attempts.attempt("--write", lambda path=path: WRITERS[path.suffix](page, options, path, made))  # type: ignore[misc]
            attempts.attempt("summary.json", lambda: save_summary(page, folder))
            if options.watching.rerun and (folder is not None or audience is not None):
                head = document.conclusion.markdown(command_of(options, out=True))
                attempts.recording(lambda: _recorded(made, head, audience))
        where = f"written to {folder.out}{options.watching.hint(folder.out)}" if folder else NOT_SAVED
        page.print(where, soft_wrap=True)


def _identified(page: Page, folder: ResultsFolder | None, options: IdentifyServo) -> tuple[ServosFit, Document]:
    """Return the fits and what they say; whatever ends that, print the joints that are done, which are saved as they come."""
    last = list[ServosFit]()

    def heard(_joint: str, _result: Identified | str, made: ServosFit) -> None:
        last[:] = [made]
        page.found |= made.parameters()
        if page.found["joints"]:
            save_summary(page, folder)

    try:
        with stages_of("identifying"):
            made = replace(servos_identified(options, heard), written=tuple(options.write))
        page.found |= made.summary()
        return made, made.document()
    except BaseException:
        if last and last[0].fits:
            servo_table(last[0].fits).show(page)
        raise


def _write(page: Page, options: IdentifyServo, path: Path, fit: ServosFit) -> None:
    """Write the robot's MJCF with the servos, and measure it in plain MuJoCo."""
    servos, found, place = fit.servos, for_mujoco(fit.fits), path.absolute().parent
    text = mjcf_of(servos, found, place, options.position)
    write_text(path, text, "--write", force=options.force, read=files_of(options))
    page.print(Text(f"written to {path}: the robot with its servos, to be commanded with angles of the file"), soft_wrap=True)
    friction = ", ".join(f"{joint} Fs {own.p['Fs']:.3g} Fv {own.p['Fv']:.3g}" for joint, own in found.items() if "Fs" in own.p)
    if any(fit.fits[joint] is not own for joint, own in found.items()):
        page.print(Text(f"its friction is fitted again as MuJoCo has it: {friction}"), soft_wrap=True)
    bare = ", ".join(joint for joint in servos.links.joints if joint not in found)
    kept = [f"{bare}: no servo is written; what the robot's file has there stays"] if bare else []
    page.warn({"the written file": [*inexpressible(found, fit.fits), *kept]})
    judged = fit.others or servos
    for log in judged.logs:
        errors = in_mujoco(judged, found, place, log, options.position)
        name = judged.name(log)
        page.found.setdefault("mujoco_error", {})[name] = errors
        off = ", ".join(f"{joint} {error:.2g}" for joint, error in errors.items())
        page.print(Text(f"{path.name} in plain MuJoCo, {name}: mean errors of positions [rad]: {off}"), soft_wrap=True)


def _write_function(page: Page, options: IdentifyServo, path: Path, fit: ServosFit) -> None:
    servos = fit.servos
    known = {joint: (servos.known.servo(joint, ""), own) for joint, own in fit.fits.items()}
    text = servo_function(Path(servos.robot).name, known, [log.name for log in servos.logs])
    write_text(path, text, "--write", force=options.force, read=files_of(options))
    page.print(Text(f"written to {path}: the servos as a Python file"), soft_wrap=True)


def _write_bam(page: Page, options: IdentifyServo, path: Path, fit: ServosFit) -> None:
    made = {joint: bam_of(own, str(fit.servos.known.stated.get("model", ""))) for joint, own in fit.fits.items()}
    for joint, (text, lost) in made.items():
        target = path if len(made) == 1 else path.with_name(f"{path.stem}_{joint.replace('/', '_')}.json")
        write_text(target, text, "--write", force=options.force, read=files_of(options))
        page.print(Text(f"written to {target}: the servo of {joint} for BAM"), soft_wrap=True)
        page.warn({"the written file": [f"BAM has no place for {', '.join(lost)} of {joint}"] if lost else []})


WRITERS = {".xml": _write, ".py": _write_function, ".json": _write_bam}
"""What writes servos, by the ending of the name."""


def _recorded(fit: ServosFit, head: str, audience: Audience | None) -> "Streams":
    from idbench.experiments.recording.servo_recording import record_servos

    servos = fit.others or fit.servos
    path, log = next(iter(servos.logs.items()))
    return record_servos(servos.links_of(path), path.stem, log, servos.simulated(fit.fits, path), head, audience)
