"""The joints of a robot with their servos: what each carries in each log, and the fits of all."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import NamedTuple, final

import numpy as np

from idbench.identify import Array, IdentificationError
from idbench.identify.files.servo_log import ServoColumns
from idbench.identify.servo import JointLoad, Servo, ServoFit, ServoRun, UnscaledError, identify_again
from idbench.identify.servo.choice import ServoFrictionChoice
from idbench.identify.servo.fit import has_scale
from idbench.identify.servo.identification import APART, OffsetJoint, per_offset, together
from idbench.identify.servo.rows import corrected, smoothed
from idbench.identify.servo.run import without_spikes
from idbench.identify.servo.stages import looked_at
from idbench.identify.telling import stage
from idbench.sim.robot.inverse_dynamics import InverseDynamics, inverse_dynamics
from idbench.sim.robot.robot import Robot


class Moving(NamedTuple):
    """How a joint moves by its fit: positions of the log [rad], shape (time,), and what makes angles of the file of them."""

    q: Array
    offset: float


def loads(robot: Robot, columns: ServoColumns, moving: Mapping[int, Moving] | None = None) -> list[JointLoad]:
    """Return the load of each joint of a robot while the others move as they were measured, or as their servos do.

    Gravity follows the joint's own angle exactly; what accelerations and velocities of the others need is that of the measured
    motion, smoothed, or of the simulated one (see `corrected`), by the number of the joint.
    """
    t, n = columns.t, robot.n
    measured = q = np.stack([without_spikes(t, x) for x in columns.q.T], axis=1)
    if n == 1:
        qd = qdd = np.zeros_like(q)
    else:
        q, qd, qdd = smoothed(t, q)
        for j, of in (moving or {}).items():
            q[:, j], qd[:, j], qdd[:, j] = corrected(t, of.q, measured[:, j])
            q[:, j] += of.offset
    dynamics = InverseDynamics(robot, len(q))
    still = np.zeros_like(q)
    whole = dynamics(q, qd, qdd).copy()
    inertia = dynamics.inertia().copy()
    found = []
    for j in range(n):
        at = [inverse_dynamics(robot, _moved(q, j, angle), still, still)[:, j] for angle in (0.0, np.pi / 2, np.pi)]
        constant = (at[0] + at[2]) / 2
        cosine, sine = at[0] - constant, at[1] - constant
        if robot.slides[j]:
            constant = at[0]
            cosine = sine = 0 * constant
        gravity = sine * np.sin(q[:, j]) + cosine * np.cos(q[:, j]) + constant
        rest = whole[:, j] - inertia[:, j] * qdd[:, j] - gravity + constant
        found.append(JointLoad(*(_constant(x) for x in (inertia[:, j], sine, cosine, rest))))
    return found


def _moved(q: Array, j: int, angle: float) -> Array:
    moved = q.copy()
    moved[:, j] = angle
    return moved


def _constant(x: Array) -> Array:
    """Return one number where all are the same but for rounding."""
    size = float(np.abs(x).max())
    return np.array(x[0] if size > 0 else 0.0) if np.ptp(x) <= 1e-9 * size or size == 0 else x


Identified = ServoFit | ServoFrictionChoice
"""Of one joint: its fit, or those with all laws of friction."""

Identify = Callable[[int, Servo, Sequence[ServoRun]], Identified]
"""Identifies one joint by its number, what is known of its servo, and its runs."""


UNLOADED = JointLoad(*(np.zeros(()) for _ in range(4)))  # stands in while columns are checked


class JointsLog(NamedTuple):
    """A log of all joints: its name, its columns, the firmware gain of each joint, and the links with what they carried."""

    name: str
    columns: ServoColumns
    kp: tuple[float, ...]
    links: Robot


@final
@dataclass(frozen=True, eq=False)
class Joints:
    """Joints of a robot, by their numbers."""

    links: Robot
    """The robot without its drives."""
    servos: tuple[Servo, ...]
    """What is known of each."""
    logs: tuple[JointsLog, ...]
    """What was logged."""

    @cached_property
    def runs(self) -> list[list[ServoRun]]:
        """Runs of each joint, while the others move as they were measured."""
        return self._loaded([{}] * len(self.logs))

    def runs_with(self, fits: Mapping[int, ServoFit]) -> list[list[ServoRun]]:
        """Return runs of each joint, while others that have a fit move as simulated, corrected by the measured slow motion."""
        return self.runs if self.links.n == 1 or not fits else self._loaded(self._moving(fits))

    def identified(self, identify: Identify) -> Iterator[tuple[int, Identified | str]]:
        """Yield the result of each joint, or why it has none; joints of an arm come again when more is known.

        Encoder counts hide accelerations. Joints are therefore fitted a second time, starting from their first estimates, to
        loads that follow from the fits of the others. A joint whose torques have no scale still moves as its fit simulates.
        Then all offsets are made to agree.
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
        every, known = self.runs_with(moving), dict[int, ServoFit]()
        for j, fit in moving.items():
            with stage(f"{self.links.joints[j]}, while the others move as their servos do"):
                again, found = _attempt(partial(identify_again, fit, every[j]))
            if found is not None and not isinstance(again, str):
                known[j] = found
            yield j, again
        with stage("offsets of all joints"):
            yield from self._together(moving, known).items()

    def _together(self, before: Mapping[int, ServoFit], fits: Mapping[int, ServoFit]) -> dict[int, ServoFit]:
        """Return fits whose offsets agree, of some whose loads assume the offsets of the fits before."""
        moving, joints = self._moving(before), {j: OffsetJoint(fit, {}) for j, fit in fits.items()}
        assumed = {k: offset_of(fit) for k, fit in before.items() if k in fits and has_scale(fit)}
        for k, offset in assumed.items():
            runs = self._loaded([{**each, k: each[k]._replace(offset=offset + APART)} for each in moving])
            for j, (fit, changes) in joints.items():
                if j != k:
                    changes[k] = per_offset(fit, looked_at(fit.servo, runs[j], before[j].p["delay"]))
        return together(joints, assumed)

    def _first(
        self, identify: Identify, j: int, servo: Servo, runs: Sequence[ServoRun]
    ) -> tuple[Identified | str, ServoFit | None]:
        if self.links.slides[j]:
            return f"{self.links.joints[j]} slides: gain and counts of servo.toml are those of a joint that turns", None
        return _attempt(partial(identify, j, servo, runs))

    def _moving(self, fits: Mapping[int, ServoFit]) -> list[dict[int, Moving]]:
        """Return how joints move by their fits, in each log."""
        simulated = {j: fit.simulate(self.runs[j]) for j, fit in fits.items()}
        return [{j: Moving(q[k], offset_of(fits[j])) for j, q in simulated.items()} for k in range(len(self.logs))]

    def _loaded(self, moving: Sequence[Mapping[int, Moving]]) -> list[list[ServoRun]]:
        """Return runs of each joint while the others move so, or as they were measured."""
        every = [[] for _ in self.links.joints]  # type: list[list[ServoRun]]
        for log, by_fits in zip(self.logs, moving, strict=True):
            for j in range(self.links.n):
                self._run(log, j, UNLOADED)  # raises LogError before loads are computed from a bad log
            for j, load in enumerate(loads(log.links, log.columns, by_fits)):
                every[j].append(self._run(log, j, load))
        return every

    def _run(self, log: JointsLog, j: int, load: JointLoad) -> ServoRun:
        columns, name = log.columns, f"{log.name}, {self.links.joints[j]}"
        on = None if columns.on is None else columns.on[:, j] > 0.5
        voltage = None if columns.voltage is None else columns.voltage[:, j]
        return ServoRun(columns.t, columns.q[:, j], columns.command[:, j], load, log.kp[j], on, voltage, name=name)


def offset_of(fit: ServoFit) -> float:
    """Return the offset that others assume of a joint [rad]: it follows from gravity, and is wrong without a scale."""
    return fit.p["offset"] if has_scale(fit) else 0.0


def _attempt(identify: Callable[[], Identified]) -> tuple[Identified | str, ServoFit | None]:
    """Return what was identified, or why not; and the fit that says how the joint moves, if there is one."""
    try:
        result = identify()
    except UnscaledError as error:
        return str(error), error.fit
    except IdentificationError as error:
        return str(error), None
    return result, result.fit if isinstance(result, ServoFrictionChoice) else result
