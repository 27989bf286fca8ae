"""The servos of a robot, identified joint by joint, and judged on held-out logs."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, final

import numpy as np
import tomli_w

from idbench.experiments.errors import ExperimentError
from idbench.experiments.servo.joints import Identified, Joints, JointsLog
from idbench.identify import Array
from idbench.identify.files.servo_log import ServoColumns, ServoFile
from idbench.identify.servo import Servo, ServoFit, ServoRun, identify_servo
from idbench.identify.servo.choice import choose_friction, lacks_of
from idbench.identify.servo.parameters import SERVO_PARAMETERS
from idbench.sim.drives import ServoDrive
from idbench.sim.engine.run import Run
from idbench.sim.robot.mounting import Mounting
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.servos import links
from idbench.sim.settings import per_joint

EXACT = 2**24
"""Counts a turn that stand for a firmware without rounding."""


def known_servos(drive: ServoDrive, n: int) -> list[Servo]:
    """Return gain, supply, largest duty and counts of the servos of n joints."""
    kp = per_joint(drive.kp, n, "drive.kp").tolist()
    return [Servo(drive.gain, x, drive.supply, drive.duty_limit, drive.counts or EXACT) for x in kp]


def servo_toml(drive: ServoDrive, robot: Robot) -> str:
    """Return what is known of the servos of a robot as servo.toml."""
    first, *others = known_servos(drive, robot.n)
    differing = {joint: {"kp": servo.kp} for joint, servo in zip(robot.joints[1:], others, strict=True) if servo.kp != first.kp}
    return tomli_w.dumps({**vars(first), **({"joints": differing} if differing else {})})


def write_commands(run: Run, robot: Robot, path: Path) -> None:
    """Write commands as they can be played on a robot: t [s], and angles of the robot's file [rad]."""
    header = ",".join(["t", *(f"command_{joint}" for joint in robot.joints)])
    np.savetxt(path, np.c_[run.log.t, run.command[0]], "%.6g", ",", header=header, comments="")


AUTO = "auto"
"""In the place of a law of friction: that which the log needs."""


@final
@dataclass(frozen=True, eq=False)
class Servos:
    """Servos of a robot with their logs; joints have their names."""

    robot: str
    """Name or file of the robot."""
    mounting: Mounting
    """How it is mounted."""
    known: ServoFile
    """What is known of the servos."""
    logs: dict[Path, ServoColumns]
    """What was logged."""

    @cached_property
    def links(self) -> Robot:
        """The robot without its drives."""
        return links(self.robot, self.mounting)

    def links_of(self, path: Path) -> Robot:
        """Return the robot without its drives, with what it carried in a log.

        Raises
        ------
        ExperimentError
            If that robot has other joints.
        """
        name = self.known.robot(path.name)
        if name is None:
            return self.links
        if name not in self._others:
            self._others[name] = links(name, self.mounting)
        other = self._others[name]
        if other.joints != self.links.joints:
            raise ExperimentError(
                f"{self.name(path)}: the joints of {name} are {', '.join(other.joints)}, those of {self.robot} "
                f"{', '.join(self.links.joints)}: they must be the same, in the same order"
            )
        return other

    @cached_property
    def _others(self) -> dict[str, Robot]:
        """Robots that logs are of, by their names."""
        return {}

    @cached_property
    def joints(self) -> Joints:
        """The joints with their logs."""
        names = self.links.joints
        logs = [
            JointsLog(
                self.name(path), columns, tuple(self.known.servo(joint, path.name).kp for joint in names), self.links_of(path)
            )
            for path, columns in self.logs.items()
        ]
        return Joints(self.links, tuple(self.known.servo(joint, "") for joint in names), tuple(logs))

    def name(self, path: Path) -> str:
        """Return what messages call a log: its file, with the folder where several files have the same name."""
        return path.name if Counter(other.name for other in self.logs)[path.name] == 1 else str(path)

    def identified(
        self, friction: str, find: Sequence[str], held: Mapping[str, dict[str, float]]
    ) -> Iterator[tuple[str, Identified | str]]:
        """Yield the fit of each joint, all laws of friction compared (`auto`), or why there is none; of an arm twice."""
        names = self.links.joints

        def identify(j: int, servo: Servo, runs: Sequence[ServoRun]) -> Identified:
            if friction == AUTO:
                return choose_friction(servo, runs, find, held[names[j]])
            return identify_servo(servo, runs, friction, find, held[names[j]])

        yield from ((names[j], result) for j, result in self.joints.identified(identify))

    def runs_with(self, fits: Mapping[str, ServoFit]) -> dict[str, list[ServoRun]]:
        """Return runs of the joints that have a fit, while the others move as their fits say."""
        runs = self.joints.runs_with({self.place(joint): fit for joint, fit in fits.items()})
        return {joint: runs[self.place(joint)] for joint in fits}

    def simulated(self, fits: Mapping[str, ServoFit], path: Path) -> dict[str, Array]:
        """Return the positions of joints from the commands of a log alone [rad], as the log has them, by joint."""
        k, runs = list(self.logs).index(path), self.runs_with(fits)
        return {joint: fit.simulate([runs[joint][k]])[0] for joint, fit in fits.items()}

    def errors(self, fits: Mapping[str, ServoFit]) -> dict[str, Array]:
        """Return the mean absolute error [rad] of each log, simulated from its commands alone, by joint."""
        runs = self.runs_with(fits)
        return {joint: fit.errors(runs[joint]) for joint, fit in fits.items()}

    def place(self, joint: str) -> int:
        """Return the number of a joint."""
        return self.links.joints.index(joint)

    def of_logs(self, logs: dict[Path, ServoColumns]) -> "Servos":
        """Return the same servos with other logs."""
        return replace(self, logs=logs)


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
