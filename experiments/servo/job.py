"""The job `servo`: a request becomes servos with their logs, what is known of them, and fits joint by joint."""

from collections.abc import Sequence
from pathlib import Path

from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.robot_model import absolute
from idbench.experiments.requests.jobs import ServoRequest
from idbench.experiments.servo.identification import AUTO, Servos
from idbench.identify import SettingError
from idbench.identify.files.servo_log import ServoColumns, ServoFile, order, read_servo_log
from idbench.identify.servo import SERVO_FRICTIONS
from idbench.identify.servo.fit import require_possible
from idbench.identify.servo.parameters import SERVO_PARAMETERS
from idbench.sim.robot.robot import Robot


def servos_of(asked: ServoRequest) -> tuple[Servos, Servos | None]:
    """Return the servos with the logs of the fit, and with those that it does not see."""
    for name, given in (("--robot", asked.robot), ("--servo", asked.servo)):
        if given is None:
            raise ExperimentError(f"{name} is missing; see idbench servo --help")
    if not asked.log:
        raise ExperimentError("name the logs of commands and positions")
    if asked.friction not in (*SERVO_FRICTIONS, AUTO):
        raise ExperimentError(f"--friction {asked.friction} is unknown; known: {', '.join(SERVO_FRICTIONS)}, {AUTO}")
    assert asked.robot is not None
    assert asked.servo is not None
    known, mounting = ServoFile.read(asked.servo), asked.mounting.mounting
    logs, held = asked.log, asked.validate
    if not held and len(logs) > 1:
        logs, held = logs[:-1], logs[-1:]
    servos = Servos(absolute(asked.robot), mounting, known, {})
    made = servos.of_logs({path: _ordered(path, asked, servos.links.joints) for path in logs})
    others = {path: _ordered(path, asked, servos.links.joints) for path in held}
    return made, servos.of_logs(others) if others else None


def held_of(asked: ServoRequest, joints: Sequence[str]) -> dict[str, dict[str, float]]:
    """Return the parameters that are known, by joint: what names a joint goes before what names none."""
    try:
        values = {name: float(value) for name, value in _stated("--hold", asked.hold).items()}
    except ValueError:
        raise ExperimentError(f"--hold {' '.join(asked.hold)}: give letters and numbers, such as a=0.5") from None
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


def files_of(asked: ServoRequest) -> tuple[Path, ...]:
    """Return the files that are read, which nothing may be written over."""
    robot = [] if asked.robot is None else [Robot.path(asked.robot)]
    return (*robot, *([asked.servo] if asked.servo else []), *asked.log, *asked.validate)


def _ordered(path: Path, asked: ServoRequest, joints: Sequence[str]) -> ServoColumns:
    columns = read_servo_log(path, _stated("--columns", asked.columns), _stated("--units", asked.units))
    place = order(columns, joints, path)
    on, voltage = (None if x is None else x[:, place] for x in (columns.on, columns.voltage))
    return ServoColumns(columns.t, columns.q[:, place], columns.command[:, place], on, voltage, tuple(joints))


def _stated(option: str, texts: Sequence[str]) -> dict[str, str]:
    stated = [text.partition("=") for text in texts]
    if wrong := [name for name, mark, value in stated if not mark or not value]:
        raise ExperimentError(f"{option} {wrong[0]}: give NAME=VALUE, such as q=position_*")
    return {name: value for name, _, value in stated}
