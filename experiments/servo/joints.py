"""The joints of a robot with their servos: what each carries in each log, and the fits of all."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import NamedTuple, final

from experiments.servo.loads import Moving, loads
from identify import IdentificationError
from identify.files.servo_log import ServoColumns
from identify.servo import JointLoad, Servo, ServoFit, ServoRun, UnscaledError, identify_again
from identify.servo.choice import FrictionChoice
from identify.telling import stage
from sim.robot.robot import Robot

Identified = ServoFit | FrictionChoice
"""Of one joint: its fit, or those with all laws of friction."""

Identify = Callable[[int, Servo, Sequence[ServoRun]], Identified]
"""Identifies one joint by its number, what is known of its servo, and its runs."""


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
        """Return runs of each joint, while others that have a fit move as that says, but for what was measured slowly."""
        return self.runs if self.links.n == 1 or not fits else self._runs(fits)

    def identified(self, identify: Identify) -> Iterator[tuple[int, Identified | str]]:
        """Yield what becomes of each joint, or why nothing does; joints of an arm come twice.

        Counts of an encoder say little of accelerations. Once all have a fit, joints are fitted again, from where they are, to
        loads that follow from the fits of the others; whether a known load sets the scale of its torques does not matter there.
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
            moving = {j: Moving(q[k], fits[j].p["offset"]) for j, q in simulated.items()}
            for j, load in enumerate(loads(self.links, log.columns, moving)):
                every[j].append(self._run(log, j, load))
        return every

    def _run(self, log: JointsLog, j: int, load: JointLoad) -> ServoRun:
        t, q, command, on, voltage, _ = vars(log.columns).values()
        own = (None if on is None else on[:, j] > 0.5, None if voltage is None else voltage[:, j])
        return ServoRun(t, q[:, j], command[:, j], load, log.kp[j], *own, name=f"{log.name}, {self.links.joints[j]}")


def _attempt(identify: Callable[[], Identified]) -> tuple[Identified | str, ServoFit | None]:
    """Return what was identified, or why not; and the fit that says how the joint moves, if there is one."""
    try:
        result = identify()
    except UnscaledError as error:
        return str(error), error.fit
    except IdentificationError as error:
        return str(error), None
    return result, result.fits[result.chosen] if isinstance(result, FrictionChoice) else result
