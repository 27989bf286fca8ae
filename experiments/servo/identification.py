"""The servos of a robot, identified joint by joint, and judged on held-out logs."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.log_warnings import warnings_of_log
from idbench.experiments.servo.joints import Identified, Joints, JointsLog
from idbench.identify import Array, MotionLog, TorqueChannel
from idbench.identify.files.servo_file import ServoFile
from idbench.identify.files.servo_log import ServoColumns
from idbench.identify.servo import Servo, ServoFit, ServoRun, identify_servo
from idbench.identify.servo.choice import choose_friction
from idbench.identify.servo.law import EXACT, KINDS
from idbench.identify.servo.parameters import SERVO_PARAMETERS
from idbench.identify.servo.run import without_spikes
from idbench.sim.drives import ServoDrive
from idbench.sim.engine.run import Run
from idbench.sim.robot.mounting import Mounting
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.servos import links
from idbench.sim.robot.tree import kinematic_tree
from idbench.sim.settings import per_joint


def known_servos(drive: ServoDrive, n: int) -> list[Servo]:
    """Gain, supply, largest duty and counts of the servos of n joints."""
    kp = per_joint(drive.kp, n, "drive.kp").tolist()
    return [Servo(drive.gain, x, drive.supply, drive.duty_limit, drive.counts or EXACT) for x in kp]


def servo_toml(drive: ServoDrive, robot: Robot) -> str:
    """The known servos of a robot as servo.toml."""
    first, *others = known_servos(drive, robot.n)
    differing = {joint: {"kp": servo.kp} for joint, servo in zip(robot.joints[1:], others, strict=True) if servo.kp != first.kp}
    names = {"limit": KINDS[first.kind].limit}
    stated = {names.get(name, name): x for name, x in vars(first).items() if x != getattr(Servo, name) or name == "kp"}
    return tomli_w.dumps(stated | ({"joints": differing} if differing else {}))


def write_commands(run: Run, robot: Robot, path: Path) -> None:
    """Write commands as they can be played on a robot: t [s], and angles of the robot's file [rad]."""
    header = ",".join(["t", *(f"command_{joint}" for joint in robot.joints)])
    np.savetxt(path, np.c_[run.log.t, run.command[0]], "%.6g", ",", header=header, comments="")


AUTO = "auto"  # In the place of a law of friction: that which the log needs


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
    notes: tuple[str, ...] = ()
    """What was read and assumed."""

    @cached_property
    def links(self) -> Robot:
        """The robot without its drives."""
        return links(self.robot, self.mounting)

    def links_of(self, path: Path) -> Robot:
        """Robot without its drives, with what it carried in a log.

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
        logs = list[JointsLog]()
        for path, columns in self.logs.items():
            servos = tuple(self.known.servo(joint, path.name) for joint in self.links.joints)
            logs.append(JointsLog(self.name(path), columns, servos, self.links_of(path)))
        return Joints(self.links, tuple(logs))

    def name(self, path: Path) -> str:
        """Name of a log in messages: its file, with the folder where several files have the same name."""
        return path.name if Counter(other.name for other in self.logs)[path.name] == 1 else str(path)

    def identified(
        self, friction: str, find: Sequence[str], held: Mapping[str, dict[str, float]], ties: Sequence[str] = ()
    ) -> Iterator[tuple[str, Identified | str]]:
        """Yield the fit of each joint, all laws of friction compared (`auto`), or why there is none; of an arm twice."""
        names = self.links.joints

        def identify(j: int, runs: Sequence[ServoRun]) -> Identified:
            if friction == AUTO:
                return choose_friction(runs, find, held[names[j]])
            return identify_servo(runs, friction, find, held[names[j]])

        yield from ((names[j], result) for j, result in self.joints.identified(identify, self.motors(ties)))

    def motors(self, ties: Sequence[str]) -> list[list[int]]:
        """Joints of each motor, by patterns of their names, several with commas."""
        names, found = self.links.joints, list[list[int]]()
        for tie in ties:
            own = [[j for j, name in enumerate(names) if fnmatchcase(name, pattern)] for pattern in tie.split(",")]
            motor = sorted({j for some in own for j in some})
            if not all(own) or len(motor) < 2:
                raise ExperimentError(f"--tie {tie}: name two joints or more, of {', '.join(names)}; * stands for any letters")
            if twice := [names[j] for j in motor if any(j in other for other in found)]:
                raise ExperimentError(f"--tie {tie}: {twice[0]} is tied already")
            found.append(motor)
        return found

    def runs_with(self, fits: Mapping[str, ServoFit]) -> dict[str, list[ServoRun]]:
        """Runs of the joints that have a fit, while the others move as their fits say."""
        runs = self.joints.runs_with({self.place(joint): fit for joint, fit in fits.items()})
        return {joint: runs[self.place(joint)] for joint in fits}

    def simulated(self, fits: Mapping[str, ServoFit], path: Path) -> dict[str, Array]:
        """Positions of joints from the commands of a log alone [rad], as the log has them, by joint."""
        k, runs = list(self.logs).index(path), self.runs_with(fits)
        return {joint: fit.simulate([runs[joint][k]])[0] for joint, fit in fits.items()}

    def errors(self, fits: Mapping[str, ServoFit]) -> dict[str, Array]:
        """Mean absolute error [rad] of each log, simulated from its commands alone, by joint."""
        runs = self.runs_with(fits)
        return {joint: fit.errors(runs[joint]) for joint, fit in fits.items()}

    @property
    def doubts(self) -> list[str]:
        """What is suspicious about the positions, but for spikes, which are left out: jumps, degrees, places out of reach."""
        tree, found = kinematic_tree(self.links), list[str]()
        for path, columns in self.logs.items():
            fs = 1 / float(np.median(np.diff(columns.t)))
            q = np.stack([without_spikes(columns.t, x) for x in columns.q.T], axis=1)
            log = MotionLog(fs, q, np.zeros_like(q), TorqueChannel("instantaneous"))
            found += [f"{self.name(path)}: {doubt}" for doubt in warnings_of_log(log, tree)]
        return found

    @property
    def moved(self) -> dict[str, float]:
        """Rms of the motion of each joint about its mean, of all logs [rad]."""
        squares = np.mean([np.var(columns.q, axis=0) for columns in self.logs.values()], axis=0)
        return dict(zip(self.links.joints, map(float, np.sqrt(squares)), strict=True))

    def place(self, joint: str) -> int:
        """Number of a joint."""
        return self.links.joints.index(joint)


def summary_of(fit: ServoFit) -> dict[str, Any]:
    """Summary of a fit."""
    return {name: _entry(fit, name) for name in fit.p} | gains_of(fit)


def _entry(fit: ServoFit, name: str) -> dict[str, Any]:
    """Value of a parameter with its errors; the factor that it is known up to; nothing of an offset without a scale."""
    if name == "offset" and name in fit.unscaled:
        return {"value": None, "sigma": None, "bound": None, "unit": unit_of(fit.servo, name)}
    sigma, bound = fit.standard_errors.get(name), fit.bound.get(name)
    entry = {"value": fit.p[name], "sigma": sigma, "bound": bound, "unit": unit_of(fit.servo, name)}
    return entry | ({"factor": list(fit.factor)} if name in fit.unscaled else {})


def gains_of(fit: ServoFit) -> dict[str, Any]:
    """Gains of a loop that commands torques, kp and kd at the joint, with the standard error of their factor a."""
    servo = fit.servo
    if servo.kind == Servo.kind:
        return {}
    a = _entry(fit, "a")
    stated = {"kp": (servo.slope, "N m/rad"), "kd": (servo.kd + servo.slope * fit.p.get("lead", 0.0), "N m s/rad")}
    return {
        name: a | {"value": a["value"] * x, "sigma": a["sigma"] and abs(x) * a["sigma"], "bound": None, "unit": unit}
        for name, (x, unit) in stated.items()
    }


def unit_of(servo: Servo, name: str) -> str:
    """Unit of a parameter; that of a is what its loop commands."""
    return KINDS[servo.kind].unit if name == "a" else SERVO_PARAMETERS[name].unit
