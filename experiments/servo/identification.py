"""The servos of a robot, identified joint by joint, and judged on held-out logs."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, final

import numpy as np

from experiments.errors import ExperimentError
from experiments.servo.loads import loads
from identify import Array, IdentificationError
from identify.files.servo_file import ServoFile
from identify.files.servo_log import ServoColumns
from identify.servo import ServoFit, ServoRun, identify_again, identify_servo
from identify.servo.choice import FrictionChoice, choose_friction
from identify.servo.lack import lacks_of
from identify.servo.parameters import SERVO_PARAMETERS
from sim.robot.mounting import Mounting
from sim.robot.robot import Robot
from sim.robot.servos import Commands, ServoValues, links, replay, with_servos

Result = ServoFit | FrictionChoice | str
"""What becomes of a joint: its fit, those with all laws of friction, or why there is none."""

AUTO = "auto"
"""In the place of a law of friction: that which the log needs."""


@final
@dataclass(frozen=True, eq=False)
class Servos:
    """Servos of a robot with their logs.

    Parameters
    ----------
    robot : str
        Name or file of the robot.
    mounting : Mounting
        How it is mounted.
    known : ServoFile
        What is known of the servos.
    logs : mapping of Path to ServoColumns
        What was logged.
    """

    robot: str
    mounting: Mounting
    known: ServoFile
    logs: dict[Path, ServoColumns]

    @cached_property
    def links(self) -> Robot:
        """The robot without its drives."""
        return links(self.robot, self.mounting)

    @cached_property
    def runs(self) -> list[list[ServoRun]]:
        """Runs of each joint, while the others move as they were measured."""
        return self._runs({})

    def runs_with(self, fits: Mapping[str, ServoFit]) -> list[list[ServoRun]]:
        """Return runs of each joint, while others that have a fit move as that says, from their commands."""
        if self.links.n == 1 or not fits:
            return self.runs
        place = {self.links.joints.index(joint): fit for joint, fit in fits.items()}
        return self._runs({j: fit.simulate(self.runs[j]) for j, fit in place.items()})

    def _runs(self, angles: Mapping[int, list[Array]]) -> list[list[ServoRun]]:
        every = [[] for _ in self.links.joints]  # type: list[list[ServoRun]]
        for k, (path, columns) in enumerate(self.logs.items()):
            for j, load in enumerate(loads(self.links, columns, {i: q[k] for i, q in angles.items()})):
                every[j].append(self._run(path, columns, j, load))
        return every

    def _run(self, path: Path, columns: ServoColumns, j: int, load: Any) -> ServoRun:
        kp = self.known.servo(self.links.joints[j], path.name).kp
        on = None if columns.on is None else columns.on[:, j] > 0.5
        voltage = None if columns.voltage is None else columns.voltage[:, j]
        name = f"{path.name}, {self.links.joints[j]}"
        return ServoRun(columns.t, columns.q[:, j], columns.command[:, j], load, kp, on, voltage, name=name)

    def fits(
        self, friction: str, find: Sequence[str], held: Mapping[str, dict[str, float]]
    ) -> Iterator[tuple[str, "ServoFit | str | FrictionChoice"]]:
        """Yield the fit of each joint, all laws of friction compared (`auto`), or why there is none."""
        for joint, runs, slides in zip(self.links.joints, self.runs, self.links.slides, strict=True):
            servo = self.known.servo(joint, "")
            try:
                if slides:
                    raise IdentificationError(f"{joint} slides: gain and counts of servo.toml are those of a joint that turns")
                if friction == AUTO:
                    yield joint, choose_friction(servo, runs, find, held[joint])
                else:
                    yield joint, identify_servo(servo, runs, friction, find, held[joint])
            except IdentificationError as error:
                yield joint, str(error)

    def fits_again(self, fits: Mapping[str, ServoFit]) -> Iterator[tuple[str, ServoFit | str]]:
        """Yield fits of the joints of an arm once more, while the others move as their fits say, not as measured."""
        if self.links.n == 1 or len(fits) == 1:
            return
        runs = dict(zip(self.links.joints, self.runs_with(fits), strict=True))
        for joint, fit in fits.items():
            try:
                yield joint, identify_again(fit, runs[joint])
            except IdentificationError as error:
                yield joint, str(error)

    def simulated(self, fits: dict[str, ServoFit], path: Path) -> dict[str, Array]:
        """Return the positions of joints from the commands of a log alone [rad], as the log has them, by joint."""
        k = list(self.logs).index(path)
        runs = dict(zip(self.links.joints, self.runs_with(fits), strict=True))
        return {joint: fit.simulate([runs[joint][k]])[0] for joint, fit in fits.items()}

    def values(self, fit: ServoFit, joint: str) -> ServoValues:
        """Return a servo as MuJoCo has it, with the firmware gain of the file."""
        p, servo = fit.p, self.known.servo(joint, "")
        known = servo.gain * servo.kp, servo.supply, servo.duty_limit
        rate, play = p.get("rate", np.inf), p.get("backlash", 0.0)
        return ServoValues(p["a"], p["b"], *known, p["Ia"], p["Fv"], p["Fs"], rate, p["delay"], play)

    def text(self, fits: dict[str, ServoFit], folder: Path, position: bool = False) -> str:
        """Return the robot's MJCF with the servos that were found."""
        place = {self.links.joints.index(joint): self.values(fit, joint) for joint, fit in fits.items()}
        return with_servos(self.robot, place, folder, self.mounting, position)

    def in_mujoco(self, text: str, folder: Path, fits: dict[str, ServoFit], path: Path) -> dict[str, float]:
        """Return the mean absolute error [rad] of each joint, a log's commands given to the written file in plain MuJoCo."""
        columns = self.logs[path]
        places = [self.links.joints.index(joint) for joint in fits]
        offset = np.zeros(self.links.n)
        offset[places] = [fit.p["offset"] for fit in fits.values()]
        if any(self.known.servo(joint, path.name).kp != self.known.servo(joint, "").kp for joint in fits):
            raise ExperimentError(f"{path.name} has another kp than the file that was written")
        on = None if columns.on is None else columns.on[:, places] > 0.5
        sent = Commands(columns.t, (columns.command + offset)[:, places], places, on)
        q = replay(self.robot, text, folder, sent, columns.q[0] + offset)
        error = np.abs(q - columns.q - offset).mean(axis=0)
        return {joint: float(error[j]) for joint, j in zip(fits, places, strict=True)}


def held_out(servos: Servos, fits: dict[str, ServoFit]) -> dict[str, Array]:
    """Return the mean absolute error [rad] of each run of other logs, by joint."""
    runs = dict(zip(servos.links.joints, servos.runs_with(fits), strict=True))
    return {joint: fit.errors(runs[joint]) for joint, fit in fits.items()}


def of_logs(servos: Servos, logs: dict[Path, ServoColumns]) -> Servos:
    """Return the same servos with other logs."""
    return replace(servos, logs=logs)


def summary_of(fit: ServoFit) -> dict[str, Any]:
    """Return what a summary says of a fit."""
    sigma, bound = fit.standard_errors, fit.bound
    return {
        name: {"value": x, "sigma": sigma.get(name), "bound": bound.get(name), "unit": SERVO_PARAMETERS[name].unit}
        for name, x in fit.p.items()
    }


def lacks_summary(fit: ServoFit) -> dict[str, Any]:
    """Return what a summary says of what a fit lacks."""
    return {"friction": fit.friction, "residuals": [lack._asdict() for lack in lacks_of(fit)]}
