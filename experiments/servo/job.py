"""The job `servo`: a request becomes servos with their logs, what is known of them, and fits joint by joint."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from idbench.experiments.document import Conclusion, Document
from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.causes import suspect_summary
from idbench.experiments.identification.reading import said_of
from idbench.experiments.identification.robot_model import absolute
from idbench.experiments.requests.jobs import ServoRequest
from idbench.experiments.servo.identification import AUTO, Servos, summary_of
from idbench.experiments.servo.joints import Identified
from idbench.experiments.servo.servo_text import choice_table, remedy_of, servo_table, verdict_lines, warnings_of
from idbench.identify import Array, IdentificationError, SettingError
from idbench.identify.files.servo_file import ServoFile
from idbench.identify.files.servo_log import USUAL, ServoColumns, ordered, read_servo_log
from idbench.identify.judge.suspect import Suspect
from idbench.identify.servo import SERVO_FRICTIONS, ServoFit
from idbench.identify.servo.choice import ServoFrictionChoice, residuals_by_state
from idbench.identify.servo.fit import require_possible
from idbench.identify.servo.law import EXACT, TimeSteps
from idbench.identify.servo.mistakes import mistake_of
from idbench.identify.servo.parameters import SERVO_PARAMETERS
from idbench.identify.telling import stage
from idbench.sim.robot.position_loops import PositionLoop, position_loops
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.time_steps import steps_of


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
    mistakes: Mapping[str, Suspect] = field(default_factory=dict)
    """What is wrong with joints, and was proved."""
    written: Sequence[Path] = ()
    """Files that will be written."""

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
    def verdicts(self) -> list[tuple[str, str]]:
        """What the errors mean: lines, each after its verdict."""
        moved = self.others.moved if self.others else {}
        return verdict_lines(self.fits, self.errors["fitted"], self.errors.get("held out", {}), moved, self.mistakes)

    @property
    def conclusion(self) -> Conclusion:
        """The verdict, and what to do next: mend what was proved, or look at the first doubt; a good result is kept."""
        remedies = [remedy_of(mistake) for mistake in self.mistakes.values()]
        doubts = [line for lines in self.warnings.values() for line in lines]
        word, finding = self.verdicts[0]
        keep = f"use {', '.join(map(str, self.written))}" if self.written else "--write robot.xml servo.py keeps the servos"
        kept = [keep] if word == "good" else doubts
        return Conclusion(word, finding, [*remedies, *kept, "log another motion, and name it with --validate"][0])

    @property
    def lines(self) -> list[str]:
        """Why joints have no fit, and what was read and assumed."""
        return [
            *(f"{joint}: no estimate: {why}" for joint, why in self.every.items() if isinstance(why, str)),
            *self.servos.notes,
        ]

    @property
    def warnings(self) -> dict[str, list[str]]:
        """What to check, by what it is about."""
        doubts = [*self.servos.doubts, *(self.others.doubts if self.others else [])]
        return {"the log": doubts, "the servos": warnings_of(self.every, self.mistakes)}

    def document(self) -> Document:
        """What the fits say: verdicts, parameters, positions of the last log and their errors."""
        loops = ", ".join(dict.fromkeys(f"driven by {fit.servo.kind}" for fit in self.fits.values()))
        title = f"{Path(self.servos.robot).stem}: {', '.join(self.fits)}"
        of_laws, (_, *others) = (choice_table(*of) for of in self.choices.items()), self.verdicts
        tables = [servo_table(self.fits, self.errors), *of_laws]
        return Document(title, loops, self.conclusion, others, self.warnings, tables, self.lines, self._figures)

    def _figures(self) -> list[tuple[str, str]]:
        """Titles and pictures of the positions of the last log, and of their errors."""
        from idbench.experiments.reports.figures import color_of  # half a second that others do not need
        from idbench.experiments.reports.panels import Panel, figure

        judged = self.others or self.servos
        path, columns = list(judged.logs.items())[-1]
        moved, off = list[Panel](), list[Panel]()
        for joint, q in judged.simulated(self.fits, path).items():
            place = judged.place(joint)
            measured, panel, error = columns.q[:, place], Panel(joint), Panel(joint)
            panel.line(columns.t, columns.command[:, place], "#c9a227", 1.0, "command")
            panel.line(columns.t, measured, "#8c8c8c", 2.4, "measured")
            panel.line(columns.t, q, color_of("explicit"), 1.0, "simulated from the commands")
            error.line(columns.t, measured - q, color_of("explicit"), 0.8)
            moved.append(panel)
            off.append(error)
        return [
            (f"Positions: {judged.name(path)}", figure(moved, 1.6, "time [s]", "position [rad]")),
            (f"Errors: {judged.name(path)}", figure(off, 1.35, "time [s]", "measured - simulated [rad]")),
        ]

    def parameters(self) -> dict[str, Any]:
        """Summary of the fits."""
        laws = {joint: {"errors": choice.errors, "p": choice.p} for joint, choice in self.choices.items()}
        lacks = {joint: [lack._asdict() for lack in residuals_by_state(fit)] for joint, fit in self.fits.items()}
        return {
            **({"laws": laws} if laws else {}),
            "joints": {joint: summary_of(fit) for joint, fit in self.fits.items()},
            "lack_of_fit": {j: {"friction": fit.friction, "residuals": lacks[j]} for j, fit in self.fits.items()},
            "diagnosis": [suspect_summary(x, [joint], x.unit, remedy_of(x)) for joint, x in self.mistakes.items()],
        }

    def summary(self) -> dict[str, Any]:
        """Summary of the fits and of their errors."""
        each = {what: {joint: [float(x) for x in e] for joint, e in of.items()} for what, of in self.errors.items()}
        return self.parameters() | {
            "position_error": each,
            "verdict": [x for _, x in self.verdicts],
            "conclusion": self.conclusion.summary(),
        }


Heard = Callable[[str, Identified | str, ServosFit], None]
"""Receives a joint, its result, and all results so far."""


def servos_identified(asked: ServoRequest, heard: Heard | None = None) -> ServosFit:
    """Servos of a robot, identified joint by joint; `heard` is called with each result, and with all results so far.

    Raises
    ------
    ExperimentError, IdentificationError, BenchError
        If something is wrong with the request or its files, or no joint has a fit.
    """
    servos, others = servos_of(asked)
    every, choices = dict[str, ServoFit | str](), dict[str, ServoFrictionChoice]()
    held = held_of(asked, servos.links.joints)
    servos.motors(asked.tie)  # what is wrong with it is said before the work
    for joint, result in servos.identified(asked.friction, asked.find, held, asked.tie):
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
    with stage("what is wrong"):
        tested = {joint: _tested(fit) for joint, fit in made.fits.items()}
    return replace(made, mistakes={joint: found for joint, found in tested.items() if found})


def _tested(fit: ServoFit) -> Suspect | None:
    """The mistake of a fit; None if there is none, or the tests fail: an estimate is not lost with them."""
    try:
        return mistake_of(fit)
    except (IdentificationError, np.linalg.LinAlgError):
        return None


def servos_of(asked: ServoRequest) -> tuple[Servos, Servos | None]:
    """Servos with the logs of the fit, and with those that it does not see."""
    if asked.robot is None:
        raise ExperimentError("--robot is missing; see idbench servo --help")
    if not asked.log:
        raise ExperimentError("name the logs of commands and positions")
    if asked.friction not in (*SERVO_FRICTIONS, AUTO):
        raise ExperimentError(f"--friction {asked.friction} is unknown; known: {', '.join(SERVO_FRICTIONS)}, {AUTO}")
    mounting = asked.mounting.mounting
    robot = Robot.load(absolute(asked.robot), mounting.edit)
    known, loops = _known(asked, robot)
    logs, held = asked.log, asked.validate
    if not held and len(logs) > 1:
        logs, held = logs[:-1], logs[-1:]
    notes = [*(f"the robot's file has {note}" for note in robot.notes), *_said(loops, known)]
    known.require(robot.joints, [path.name for path in (*logs, *held)])
    read = {path: _read(path, asked, robot.joints, loops) for path in (*logs, *held)}
    notes += [said for _, said in read.values() if said]
    servos = Servos(absolute(asked.robot), mounting, known, {}, tuple(notes))
    made, others = (replace(servos, logs={path: read[path][0] for path in of}) for of in (logs, held))
    return made, others if held else None


def _known(asked: ServoRequest, robot: Robot) -> tuple[ServoFile, dict[str, PositionLoop]]:
    """Known servos, by --servo or by the actuators of the robot's file, and the loops of these."""
    steps = {joint: TimeSteps(*x) for joint, x in steps_of(robot).items()} if asked.simulated else {}
    if asked.servo is not None:
        return replace(ServoFile.read(asked.servo), steps=steps), {}
    loops = position_loops(robot)
    if lacking := [joint for joint in robot.joints if joint not in loops]:
        raise ExperimentError(
            f"--servo is missing: {asked.robot} has no actuator that controls the position of {', '.join(lacking)}; state the "
            'loop, such as kind = "torque", kp = 25, kd = 0.6, or model = "STS3215"; --lock NAME=VALUE holds a joint'
        )
    return ServoFile({"counts": EXACT}, {joint: dict(loop.stated) for joint, loop in loops.items()}, {}, steps), loops


def _said(loops: Mapping[str, PositionLoop], known: ServoFile) -> Iterator[str]:
    """Yield what the actuators of the robot's file state, which was taken."""
    if loops:
        each = ", ".join(f"{joint} {loop.stated['kp']:.4g} {loop.stated['kd']:.4g}" for joint, loop in loops.items())
        yield f"kp and kd of its actuators: {each}"
        if not known.steps:
            yield "nothing is said of time steps: for a log of a MuJoCo simulation add --simulated"


def held_of(asked: ServoRequest, joints: Sequence[str]) -> dict[str, dict[str, float]]:
    """Parameters that are known, by joint: what names a joint goes before what names none."""
    try:
        values = {name: float(value) for name, _, value in (text.partition("=") for text in asked.hold)}
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


def _read(
    path: Path, asked: ServoRequest, joints: Sequence[str], loops: Mapping[str, PositionLoop]
) -> tuple[ServoColumns, str]:
    """A log in the order of the joints, commands as angles, and what was assumed of it."""
    columns, said = read_servo_log(path, said_of(asked.columns, asked.units, asked.rows, tuple(USUAL)))
    columns = ordered(columns, joints, {loop.actuator: joint for joint, loop in loops.items()}, path)
    if loops:
        both = [loops[joint].commanded(u) for joint, u in zip(joints, columns.command.T, strict=True)]
        angle, torque = (np.stack(x, axis=1) for x in zip(*both, strict=True))
        columns = replace(columns, command=angle, forward=torque if torque.any() else columns.forward)
    return columns, said
