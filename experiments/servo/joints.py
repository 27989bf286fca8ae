"""The joints of a robot with their servos: what each carries in each log, and the fits of all."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import NamedTuple, final

import numpy as np

from experiments.servo.loads import Moving, loads
from identify import IdentificationError
from identify.files.servo_log import ServoColumns
from identify.servo import JointLoad, Servo, ServoFit, ServoRun, UnscaledError, identify_again
from identify.servo.choice import FrictionChoice
from identify.servo.refusals import has_scale
from identify.telling import stage
from sim.robot.robot import Robot

Identified = ServoFit | FrictionChoice
"""Of one joint: its fit, or those with all laws of friction."""

Identify = Callable[[int, Servo, Sequence[ServoRun]], Identified]
"""Identifies one joint by its number, what is known of its servo, and its runs."""


UNLOADED = JointLoad(*(np.zeros(()) for _ in range(4)))


class JointsLog(NamedTuple):
    """A log of all joints: its name, its columns, and the firmware gain of each joint."""

    name: str
    columns: ServoColumns
    kp: tuple[float, ...]


@final
@dataclass(frozen=True, eq=False)
class Joints:
    """Joints of a robot, by their numbers.

    Parameters
    ----------
    links : Robot
        The robot without its drives.
    servos : tuple of Servo
        What is known of each.
    logs : tuple of JointsLog
        What was logged.
    """

    links: Robot
    servos: tuple[Servo, ...]
    logs: tuple[JointsLog, ...]

    @cached_property
    def runs(self) -> list[list[ServoRun]]:
        """Runs of each joint, while the others move as they were measured."""
        return self._runs({})

    def runs_with(self, fits: Mapping[int, ServoFit]) -> list[list[ServoRun]]:
        """Return runs of each joint, while others that have a fit move as simulated, corrected by the measured slow motion."""
        return self.runs if self.links.n == 1 or not fits else self._runs(fits)

    def identified(self, identify: Identify) -> Iterator[tuple[int, Identified | str]]:
        """Yield the result of each joint, or why it has none; joints of an arm come twice.

        Encoder counts hide accelerations. Joints are therefore fitted a second time, starting from their first estimates, to
        loads that follow from the fits of the others. A joint whose torques have no scale still moves as its fit simulates.
        """
        moving = dict[int, ServoFit]()
        for j, (joint, servo, runs) in enumerate(zip(self.links.joints, self.servos, self.runs, strict=True)):
            with stage(joint):
                result, fit = self._first(identify, j, servo, runs)
            if fit is not None:
                moving[j] = fit
            yield j, result
        if len(moving) < 2:
            return
        every = self.runs_with(moving)
        for j, fit in moving.items():
            with stage(f"{self.links.joints[j]}, while the others move as their servos do"):
                again, _ = _attempt(partial(identify_again, fit, every[j]))
            yield j, again

    def _first(
        self, identify: Identify, j: int, servo: Servo, runs: Sequence[ServoRun]
    ) -> tuple[Identified | str, ServoFit | None]:
        if self.links.slides[j]:
            return f"{self.links.joints[j]} slides: gain and counts of servo.toml are those of a joint that turns", None
        return _attempt(partial(identify, j, servo, runs))

    def _runs(self, fits: Mapping[int, ServoFit]) -> list[list[ServoRun]]:
        simulated = {j: fit.simulate(self.runs[j]) for j, fit in fits.items()}
        every = [[] for _ in self.links.joints]  # type: list[list[ServoRun]]
        for k, log in enumerate(self.logs):
            for j in range(self.links.n):
                self._run(log, j, UNLOADED)  # raises LogError before loads are computed from a bad log
            # Offsets follow from gravity: without a scale they are wrong.
            moving = {j: Moving(q[k], fits[j].p["offset"] if has_scale(fits[j]) else 0.0) for j, q in simulated.items()}
            for j, load in enumerate(loads(self.links, log.columns, moving)):
                every[j].append(self._run(log, j, load))
        return every

    def _run(self, log: JointsLog, j: int, load: JointLoad) -> ServoRun:
        columns, name = log.columns, f"{log.name}, {self.links.joints[j]}"
        on = None if columns.on is None else columns.on[:, j] > 0.5
        voltage = None if columns.voltage is None else columns.voltage[:, j]
        return ServoRun(columns.t, columns.q[:, j], columns.command[:, j], load, log.kp[j], on, voltage, name=name)


def _attempt(identify: Callable[[], Identified]) -> tuple[Identified | str, ServoFit | None]:
    """Return what was identified, or why not; and the fit that says how the joint moves, if there is one."""
    try:
        result = identify()
    except UnscaledError as error:
        return str(error), error.fit
    except IdentificationError as error:
        return str(error), None
    return result, result.fit if isinstance(result, FrictionChoice) else result
