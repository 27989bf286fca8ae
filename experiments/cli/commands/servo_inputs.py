"""What the command that identifies servos reads."""

from collections.abc import Sequence
from pathlib import Path

from idbench.experiments.cli.options.servo import IdentifyServo
from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.robot_model import absolute
from idbench.experiments.servo.identification import AUTO, Servos
from idbench.identify import SettingError
from idbench.identify.files.servo_log import ServoColumns, ServoFile, order, read_servo_log
from idbench.identify.servo import SERVO_FRICTIONS
from idbench.identify.servo.fit import require_possible
from idbench.identify.servo.parameters import SERVO_PARAMETERS
from idbench.sim.robot.robot import Robot


def servos_of(options: IdentifyServo) -> tuple[Servos, Servos | None]:
    """Return the servos with the logs of the fit, and with those that it does not see."""
    for name, given in (("--robot", options.robot), ("--servo", options.servo)):
        if given is None:
            raise ExperimentError(f"{name} is missing; see idbench servo --help")
    if not options.log:
        raise ExperimentError("name the logs of commands and positions")
    if options.friction not in (*SERVO_FRICTIONS, AUTO):
        raise ExperimentError(f"--friction {options.friction} is unknown; known: {', '.join(SERVO_FRICTIONS)}, {AUTO}")
    assert options.robot is not None
    assert options.servo is not None
    known, mounting = ServoFile.read(options.servo), options.mounting.mounting
    logs, held = options.log, options.validate
    if not held and len(logs) > 1:
        logs, held = logs[:-1], logs[-1:]
    servos = Servos(absolute(options.robot), mounting, known, {})
    made = servos.of_logs({path: _ordered(path, options, servos.links.joints) for path in logs})
    others = {path: _ordered(path, options, servos.links.joints) for path in held}
    return made, servos.of_logs(others) if others else None


def held_of(options: IdentifyServo, joints: Sequence[str]) -> dict[str, dict[str, float]]:
    """Return the parameters that are known, by joint: what names a joint goes before what names none."""
    try:
        values = {name: float(value) for name, value in _stated("--hold", options.hold).items()}
    except ValueError:
        raise ExperimentError(f"--hold {' '.join(options.hold)}: give letters and numbers, such as a=0.5") from None
    split = {name: name.rpartition(".") for name in values}
    if unknown := [joint for joint, _, _ in split.values() if joint and joint not in joints]:
        raise ExperimentError(f"--hold {unknown[0]}: no such joint; joints are {', '.join(joints)}")
    if wrong := [letter for _, _, letter in split.values() if letter not in SERVO_PARAMETERS]:
        raise ExperimentError(f"--hold: a servo has no parameter {wrong[0]!r}; known: {', '.join(SERVO_PARAMETERS)}")
    for name, (_, _, letter) in split.items():
        try:
            require_possible({letter: values[name]})
        except SettingError as error:
            raise ExperimentError(f"--hold {name}: {error}") from error
    return {
        joint: {letter: values[name] for of in ("", joint) for name, (own, _, letter) in split.items() if own == of}
        for joint in joints
    }


def files_read(options: IdentifyServo) -> tuple[Path, ...]:
    """Return the files that are read, which nothing may be written over."""
    robot = [] if options.robot is None else [Robot.path(options.robot)]
    return (*robot, *([options.servo] if options.servo else []), *options.log, *options.validate)


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
