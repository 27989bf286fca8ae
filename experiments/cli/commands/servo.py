"""The command that identifies servos."""

from collections.abc import Mapping
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from rich.text import Text

from idbench.experiments.cli.command_text import command_of
from idbench.experiments.cli.options.jobs import IdentifyServo
from idbench.experiments.cli.page import Page, new_page, shown, stages_of
from idbench.experiments.errors import ExperimentError
from idbench.experiments.recording.audience import Audience
from idbench.experiments.results.attempts import Attempts
from idbench.experiments.results.folder import ResultsFolder
from idbench.experiments.results.writing import require_free, write_summary, write_text
from idbench.experiments.servo.identification import Servos, lacks_summary, summary_of
from idbench.experiments.servo.job import files_of, held_of, servos_of
from idbench.experiments.servo.servo_text import (
    in_mujoco,
    inexpressible,
    mjcf_of,
    print_choice,
    print_errors,
    print_servos,
    servo_function,
    verdicts,
    warnings_of,
    without_servo,
)
from idbench.identify.servo import ServoFit
from idbench.identify.servo.choice import FrictionChoice

if TYPE_CHECKING:
    from idbench.experiments.recording.folder import Streams


def servo(options: IdentifyServo) -> None:
    """Identify servos."""
    page, folder = new_page(machine=options.json), _folder(options)
    for option, path, ending in (("--write-mjcf", options.write_mjcf, ".xml"), ("--write", options.write, ".py")):
        if path is not None:
            if path.suffix != ending:
                raise ExperimentError(f"{option} {path}: its name must end with {ending}")
            require_free(path, option, force=options.force, read=files_of(options))
    with options.watching.audience() as audience, shown(page), folder.held() if folder else nullcontext():
        servos, others = servos_of(options)
        page.found |= {"experiment": "servo", "robot": servos.robot, "friction": options.friction, "joints": {}}
        found = _identified(page, folder, options, servos)
        _judge(page, servos, others, found)
        page.show()
        _save(page, folder)
        with Attempts("the results are printed" + (f", and in {folder.out}" if folder else ""), folder) as attempts:
            if options.write_mjcf is not None:
                attempts.attempt("--write-mjcf", lambda: _write(page, options, servos, others, found))
                attempts.attempt("summary.json", lambda: _save(page, folder))
            if options.write is not None:
                attempts.attempt("--write", lambda: _write_function(page, options, servos, found))
            if options.watching.rerun and (folder is not None or audience is not None):
                attempts.recording(lambda: _recorded(others or servos, found, audience))
        if folder is not None:
            page.print(f"written to {folder.out}{options.watching.hint(folder.out)}", soft_wrap=True)


def _identified(page: Page, folder: ResultsFolder | None, options: IdentifyServo, servos: Servos) -> dict[str, ServoFit]:
    """Return the fits that there are; print and save those of joints that are done if the others are not waited for."""
    every, held = dict[str, ServoFit | str](), held_of(options, servos.links.joints)
    try:
        with stages_of("identifying"):
            for joint, result in servos.identified(options.friction, options.find, held):
                if isinstance(result, FrictionChoice):
                    print_choice(page, joint, result)
                    page.found.setdefault("laws", {})[joint] = {"errors": result.errors, "p": result.p}
                if isinstance(result, str):
                    page.found.get("laws", {}).pop(joint, None)
                every[joint] = result.fit if isinstance(result, FrictionChoice) else result
                _take(page, folder, every)
    finally:
        found = _fits(every)
        if found:
            print_servos(page, every)
    if not found:
        raise ExperimentError("; ".join(dict.fromkeys(str(why) for why in every.values())))
    page.warn({"the servos": warnings_of(every)})
    return found


def _fits(every: Mapping[str, ServoFit | str]) -> dict[str, ServoFit]:
    return {joint: fit for joint, fit in every.items() if isinstance(fit, ServoFit)}


def _take(page: Page, folder: ResultsFolder | None, every: dict[str, ServoFit | str]) -> None:
    page.found["joints"] = {joint: summary_of(fit) for joint, fit in _fits(every).items()}
    page.found["lack_of_fit"] = {joint: lacks_summary(fit) for joint, fit in _fits(every).items()}
    if page.found["joints"]:
        _save(page, folder)


def _judge(page: Page, servos: Servos, others: Servos | None, found: dict[str, ServoFit]) -> None:
    """Print errors of positions from commands alone, on the logs of the fit and on others, and what they mean."""
    fitted, elsewhere = servos.errors(found), others.errors(found) if others else {}
    for what, each in (("fitted", fitted), ("held out", elsewhere)):
        print_errors(page, f"{what} logs", each)
    every = {"fitted": fitted} | ({"held out": elsewhere} if others else {})
    page.found["position_error"] = {
        what: {joint: [float(x) for x in e] for joint, e in each.items()} for what, each in every.items()
    }
    page.found["verdict"] = verdicts(found, fitted, elsewhere)
    for line in page.found["verdict"]:
        page.print(Text(line), soft_wrap=True)


def _write(page: Page, options: IdentifyServo, servos: Servos, others: Servos | None, found: dict[str, ServoFit]) -> None:
    """Write the robot's MJCF with the servos, and measure it in plain MuJoCo."""
    path = options.write_mjcf
    assert path is not None
    place = path.absolute().parent
    text = mjcf_of(servos, found, place, options.position)
    write_text(path, text, "--write-mjcf", force=options.force, read=files_of(options))
    page.print(Text(f"written to {path}: the robot with its servos, to be commanded with angles of the file"), soft_wrap=True)
    page.warn({"the written file": [*inexpressible(found), *without_servo(servos.links.joints, found)]})
    judged = others or servos
    for log in judged.logs:
        try:
            errors = in_mujoco(judged, text, place, found, log)
        except ExperimentError as error:  # other logs may be of the gain that was written
            page.warn({"the written file": [str(error)]})
            continue
        name = judged.name(log)
        page.found.setdefault("mujoco_error", {})[name] = errors
        print_errors(page, f"{path.name} in plain MuJoCo, {name}", {joint: np.array([e]) for joint, e in errors.items()})


def _write_function(page: Page, options: IdentifyServo, servos: Servos, found: dict[str, ServoFit]) -> None:
    path = options.write
    assert path is not None
    known = {joint: (servos.known.servo(joint, ""), fit) for joint, fit in found.items()}
    text = servo_function(Path(servos.robot).name, known, [log.name for log in servos.logs])
    write_text(path, text, "--write", force=options.force, read=files_of(options))
    page.print(Text(f"written to {path}: the servos as a Python file"), soft_wrap=True)


def _recorded(servos: Servos, found: dict[str, ServoFit], audience: Audience | None) -> "Streams":
    from idbench.experiments.recording.servo_recording import record_servos

    path, log = next(iter(servos.logs.items()))
    return record_servos(servos.links_of(path), path.stem, log, servos.simulated(found, path), audience)


def _folder(options: IdentifyServo) -> ResultsFolder | None:
    if options.out is None:
        return None
    command = command_of("servo", options, "log", ("out", "force", "json", "write_mjcf", "write", "watching"), absolute=True)
    folder = ResultsFolder(options.out, "servo", command, options.force, files_of(options))
    folder.check()
    return folder


def _save(page: Page, folder: ResultsFolder | None) -> None:
    if folder is not None:
        with folder.complete() as hidden:
            write_summary(hidden / "summary.json", page.found)
