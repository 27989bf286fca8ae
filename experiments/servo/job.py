"""The job `servo`: a request becomes servos with their logs, what is known of them, and fits joint by joint."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, final

from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.robot_model import absolute
from idbench.experiments.requests.jobs import ServoRequest
from idbench.experiments.servo.identification import AUTO, Servos, lacks_summary, summary_of
from idbench.experiments.servo.joints import Identified
from idbench.experiments.servo.servo_text import verdicts
from idbench.identify import Array, SettingError
from idbench.identify.files.servo_log import ServoColumns, ServoFile, order, read_servo_log
from idbench.identify.servo import SERVO_FRICTIONS, ServoFit
from idbench.identify.servo.choice import ServoFrictionChoice
from idbench.identify.servo.fit import require_possible
from idbench.identify.servo.parameters import SERVO_PARAMETERS
from idbench.sim.robot.robot import Robot


@final
@dataclass(frozen=True, eq=False)
class ServosFit:
    """Servos of a robot, identified and judged."""

    servos: Servos
    """The servos with the logs of the fit."""
    others: Servos | None
    """The same with held-out logs, if there are any."""
    every: Mapping[str, ServoFit | str]
    """The fit of each joint, or why it has none."""
    choices: Mapping[str, ServoFrictionChoice]
    """The laws of friction that were compared, of joints that have a fit."""

    @property
    def fits(self) -> dict[str, ServoFit]:
        """The fits of joints that have one."""
        return {joint: fit for joint, fit in self.every.items() if isinstance(fit, ServoFit)}

    @cached_property
    def errors(self) -> dict[str, dict[str, Array]]:
        """Mean absolute error of positions from commands alone [rad], by the kind of log and joint, shape (log,)."""
        found = {"fitted": self.servos.errors(self.fits)}
        return found | ({"held out": self.others.errors(self.fits)} if self.others else {})

    @property
    def verdicts(self) -> list[str]:
        """What the errors mean."""
        return verdicts(self.fits, self.errors["fitted"], self.errors.get("held out", {}))

    def parameters(self) -> dict[str, Any]:
        """Return what a summary.json says of the fits."""
        laws = {joint: {"errors": choice.errors, "p": choice.p} for joint, choice in self.choices.items()}
        return {
            **({"laws": laws} if laws else {}),
            "joints": {joint: summary_of(fit) for joint, fit in self.fits.items()},
            "lack_of_fit": {joint: lacks_summary(fit) for joint, fit in self.fits.items()},
        }

    def summary(self) -> dict[str, Any]:
        """Return what a summary.json says of the fits and of their errors."""
        each = {what: {joint: [float(x) for x in e] for joint, e in of.items()} for what, of in self.errors.items()}
        return self.parameters() | {"position_error": each, "verdict": self.verdicts}


Heard = Callable[[str, Identified | str, ServosFit], None]
"""Hears the result of a joint, and all results so far."""


def servos_identified(asked: ServoRequest, heard: Heard | None = None) -> ServosFit:
    """Return the servos of a robot, identified joint by joint.

    Raises
    ------
    ExperimentError, IdentificationError, BenchError
        If something is wrong with the request or its files, or no joint has a fit.
    """
    servos, others = servos_of(asked)
    every, choices = dict[str, ServoFit | str](), dict[str, ServoFrictionChoice]()
    for joint, result in servos.identified(asked.friction, asked.find, held_of(asked, servos.links.joints)):
        if isinstance(result, ServoFrictionChoice):
            choices[joint] = result
        elif isinstance(result, str):
            choices.pop(joint, None)
        every[joint] = result.fit if isinstance(result, ServoFrictionChoice) else result
        if heard:
            heard(joint, result, ServosFit(servos, others, dict(every), dict(choices)))
    made = ServosFit(servos, others, every, choices)
    if not made.fits:
        raise ExperimentError("; ".join(dict.fromkeys(str(why) for why in every.values())))
    return made


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
