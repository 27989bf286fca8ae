"""The command that identifies servos."""

from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path

import numpy as np
from rich.text import Text

from experiments.cli.command_text import command_of
from experiments.cli.options.servo import IdentifyServo
from experiments.cli.page import Page, new_page, shown
from experiments.cli.progress import stages_of
from experiments.errors import ExperimentError
from experiments.identification.robot_model import absolute
from experiments.results.attempts import Attempts
from experiments.results.folder import ResultsFolder
from experiments.results.summaries import write_summary
from experiments.results.writing import require_free, write_text
from experiments.servo.identification import Servos, held_out, of_logs, summary_of
from experiments.servo.servo_text import inexpressible, print_errors, print_servos, warnings_of
from identify.files.servo_file import ServoFile
from identify.files.servo_log import ServoColumns, order, read_servo_log
from identify.servo import SERVO_FRICTIONS, ServoFit
from sim.robot.robot import Robot


def servo(options: IdentifyServo) -> None:
    """Identify servos."""
    page, folder = new_page(machine=options.json), _folder(options)
    if options.write_mjcf is not None:
        if options.write_mjcf.suffix != ".xml":
            raise ExperimentError(f"--write-mjcf {options.write_mjcf}: its name must end with .xml")
        require_free(options.write_mjcf, "--write-mjcf", force=options.force, read=_read(options))
    with shown(page), folder.held() if folder else nullcontext():
        servos, others = _servos(options)
        with stages_of(f"identifying {', '.join(servos.links.joints)}"):
            fits = servos.fits(options.friction, options.find, _held(options))
        found = {joint: fit for joint, fit in fits.items() if isinstance(fit, ServoFit)}
        print_servos(page, fits)
        page.found |= {"experiment": "servo", "robot": servos.robot, "friction": options.friction}
        page.found |= {"joints": {joint: summary_of(fit) for joint, fit in found.items()}}
        _print_errors(page, servos, others, found)
        page.warn({"the servos": warnings_of(fits)})
        page.show()
        _save(page, folder)
        with Attempts("the results are printed" + (f", and in {folder.out}" if folder else ""), folder) as attempts:
            if options.write_mjcf is not None:
                attempts.attempt("--write-mjcf", lambda: _write(page, options, servos, others, found))
                attempts.attempt("summary.json", lambda: _save(page, folder))
        if folder is not None:
            page.print(f"written to {folder.out}", soft_wrap=True)


def _print_errors(page: Page, servos: Servos, others: Servos | None, found: dict[str, ServoFit]) -> None:
    """Print errors of positions from commands alone, on the logs of the fit and on others."""
    errors = {"fitted": held_out(servos, found)} | ({"held out": held_out(others, found)} if others else {})
    for what, each in errors.items():
        print_errors(page, f"{what} logs", each)
    page.found["position_error"] = {
        what: {joint: [float(x) for x in e] for joint, e in each.items()} for what, each in errors.items()
    }


def _servos(options: IdentifyServo) -> tuple[Servos, Servos | None]:
    """Return the servos with the logs of the fit, and with those that it does not see."""
    for name, given in (("--robot", options.robot), ("--servo", options.servo)):
        if given is None:
            raise ExperimentError(f"{name} is missing; see idbench servo --help")
    if not options.log:
        raise ExperimentError("name the logs of commands and positions")
    if options.friction not in SERVO_FRICTIONS:
        raise ExperimentError(f"--friction {options.friction} is unknown; known: {', '.join(SERVO_FRICTIONS)}")
    assert options.robot is not None
    assert options.servo is not None
    known, mounting = ServoFile.read(options.servo), options.mounting.mounting
    logs, held = options.log, options.validate
    if not held and len(logs) > 1:
        logs, held = logs[:-1], logs[-1:]
    servos = Servos(absolute(options.robot), mounting, known, {})
    made = of_logs(servos, {path: _ordered(path, options, servos.links.joints) for path in logs})
    others = {path: _ordered(path, options, servos.links.joints) for path in held}
    return made, of_logs(servos, others) if others else None


def _held(options: IdentifyServo) -> dict[str, float]:
    try:
        return {name: float(value) for name, value in _stated("--hold", options.hold).items()}
    except ValueError:
        raise ExperimentError(f"--hold {' '.join(options.hold)}: give letters and numbers, such as a=0.5") from None


def _ordered(path: Path, options: IdentifyServo, joints: Sequence[str]) -> ServoColumns:
    columns = read_servo_log(path, _stated("--columns", options.columns), _stated("--units", options.units))
    place = order(columns, joints, path)
    on, voltage = (None if x is None else x[:, place] for x in (columns.on, columns.voltage))
    return ServoColumns(columns.t, columns.q[:, place], columns.command[:, place], on, voltage, tuple(joints))


def _stated(option: str, texts: Sequence[str]) -> dict[str, str]:
    stated = [text.partition("=") for text in texts]
    if wrong := [name for name, mark, value in stated if not mark or not value]:
        raise ExperimentError(f"{option} {wrong[0]}: give NAME=VALUE, such as q=position_*")
    return {name: value for name, _, value in stated}


def _write(page: Page, options: IdentifyServo, servos: Servos, others: Servos | None, found: dict[str, ServoFit]) -> None:
    """Write the robot's MJCF with the servos, and measure it in plain MuJoCo."""
    path = options.write_mjcf
    assert path is not None
    place = path.absolute().parent
    text = servos.text(found, place, options.position)
    write_text(path, text, "--write-mjcf", force=options.force, read=_read(options))
    page.print(Text(f"written to {path}: the robot with its servos, to be commanded with angles of the file"), soft_wrap=True)
    for each in (of_logs(servos, {log: logs.logs[log]}) for logs in (others or servos,) for log in logs.logs):
        log = next(iter(each.logs))
        errors = each.in_mujoco(text, place, found, log)
        page.found.setdefault("mujoco_error", {})[log.name] = errors
        print_errors(page, f"{path.name} in plain MuJoCo, {log.name}", {joint: np.array([e]) for joint, e in errors.items()})
    page.warn({"the written file": inexpressible(found)})


def _read(options: IdentifyServo) -> tuple[Path, ...]:
    robot = [] if options.robot is None else [Robot.path(options.robot)]
    return (*robot, *([options.servo] if options.servo else []), *options.log, *options.validate)


def _folder(options: IdentifyServo) -> ResultsFolder | None:
    if options.out is None:
        return None
    command = command_of("servo", options, "log", ("out", "force", "json", "write_mjcf"), absolute=True)
    folder = ResultsFolder(options.out, "servo", command, options.force, _read(options))
    folder.check()
    return folder


def _save(page: Page, folder: ResultsFolder | None) -> None:
    if folder is not None:
        with folder.complete() as hidden:
            write_summary(hidden / "summary.json", page.found)
