"""The joints of a robot with their servos: what each carries in each log, and the fits of all."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np

from idbench.identify import Array, IdentificationError
from idbench.identify.files.servo_log import ServoColumns
from idbench.identify.servo import JointLoad, Servo, ServoFit, ServoRun, identify_again
from idbench.identify.servo.choice import ServoFrictionChoice
from idbench.identify.servo.identification import APART, OffsetJoint, per_offset, tied, together
from idbench.identify.servo.rows import corrected, smoothed
from idbench.identify.servo.run import without_spikes
from idbench.identify.servo.stages import searched_runs
from idbench.identify.telling import stage
from idbench.sim.robot.inverse_dynamics import inverse_dynamics, mass_matrices
from idbench.sim.robot.robot import Robot


class Moving(NamedTuple):
    """How a joint moves by its fit: steps [s], positions of the log [rad], and what makes angles of the file of them.

    Of a simulation beside: its armature, what its integrator adds to that where it takes damping late, and how much earlier
    than positions its velocities are [s] (see `TimeSteps`).
    """

    t: Array
    q: Array
    offset: float
    armature: float = 0.0
    taken: float = 0.0
    early: float = 0.0


def loads(robot: Robot, columns: ServoColumns, moving: Mapping[int, Moving] | None = None) -> list[JointLoad]:
    """Load of each joint of a robot while the others move as they were measured, or as their servos do.

    Gravity follows the joint's own angle exactly; what accelerations and velocities of the others need is that of the measured
    motion, smoothed, or of the simulated one (see `corrected`), by the number of the joint, at each step of its simulation: a
    command that jumps makes accelerations that are over before the next sample.
    """
    t, n = columns.t, robot.n
    measured = np.stack([without_spikes(t, x) for x in columns.q.T], axis=1)
    if n == 1:
        still = np.zeros((1, 1))
        return [JointLoad(mass_matrices(robot, still, still, still)[0][0, 0, 0], *(x[0, 0] for x in _gravity(robot, still)))]
    fine = min((of.t for of in (moving or {}).values()), key=lambda x: x[1] - x[0], default=t)
    q, qd, qdd = smoothed(t, measured)
    slow = [np.stack([np.interp(fine, t, x) for x in y.T], axis=1) for y in (q, qd, qdd)]
    for j, of in (moving or {}).items():
        for y, x in zip(slow, corrected(fine, np.interp(fine, of.t, of.q), t, measured[:, j]), strict=True):
            y[:, j] = x
        slow[0][:, j] += of.offset
        slow[1][:, j] -= of.early * slow[2][:, j]
        q[:, j] += of.offset
    q_fine, qd_fine, qdd_fine = slow
    M, whole = mass_matrices(robot, q_fine, qd_fine, qdd_fine)
    inertia = np.diagonal(M, axis1=1, axis2=2)
    lightness, shaking = _seen_by_friction(M, qdd_fine, moving or {})
    sines, cosines, _ = _gravity(robot, q)
    found = []
    for j in range(n):
        sine, cosine = (np.interp(fine, t, x[:, j]) for x in (sines, cosines))
        gravity = sine * np.sin(q_fine[:, j]) + cosine * np.cos(q_fine[:, j])
        rest = whole[:, j] - inertia[:, j] * qdd_fine[:, j] - gravity
        parts = [_constant(x) for x in (inertia[:, j], sine, cosine, rest, lightness[:, j], shaking[:, j])]
        found.append(JointLoad(parts[0], parts[1], parts[2], parts[3], parts[4], parts[5], fine))
    return found


def _seen_by_friction(M: Array, qdd: Array, moving: Mapping[int, Moving]) -> tuple[Array, Array]:
    """Diagonals of the inverse mass matrix, and how others' damping shakes each joint, shape (time, joint).

    MuJoCo finds dry friction by accelerations without what its integrator then takes late of the damping, h D: those are
    (1 + M^-1 h D) a. Zeros where nothing is taken late.
    """
    armature, taken = np.zeros((2, M.shape[-1]))
    for j, of in moving.items():
        armature[j], taken[j] = of.armature, of.taken
    if not taken.any():
        return np.zeros_like(qdd), np.zeros_like(qdd)
    inverse = np.linalg.inv(M + np.diag(armature))
    diagonal = np.diagonal(inverse, axis1=1, axis2=2)
    pushed = taken * qdd
    return diagonal, np.einsum("tjk,tk->tj", inverse, pushed) - diagonal * pushed


def _gravity(robot: Robot, q: Array) -> tuple[Array, Array, Array]:
    """Gravity along sine and cosine of each joint's angle while the others stand at q, and of slides, each (time, n).

    A turn by delta from where a joint is turns the weight that it carries: c cos(delta) + s sin(delta), c being the torque
    there, and s that after a quarter of a turn.
    """
    still = np.zeros_like(q)
    there = inverse_dynamics(robot, q, still, still)
    turned = q + np.pi / 2 * np.eye(robot.n)[:, None]  # shape (joint that is turned, time, joint)
    quarter = np.stack([inverse_dynamics(robot, turned[j], still, still)[:, j] for j in range(robot.n)], axis=1)
    sine, cosine = there * np.sin(q) + quarter * np.cos(q), there * np.cos(q) - quarter * np.sin(q)
    slides = np.asarray(robot.slides, dtype=bool)
    return np.where(slides, 0.0, sine), np.where(slides, 0.0, cosine), np.where(slides, there, 0.0)


def _constant(x: Array) -> Array:
    """One number where all are the same but for rounding."""
    size = float(np.abs(x).max())
    return np.array(x[0] if size > 0 else 0.0) if np.ptp(x) <= 1e-9 * size or size == 0 else x


Identified = ServoFit | ServoFrictionChoice
"""Of one joint: its fit, or those with all laws of friction."""


SWEEPS = 4
"""Times that motions of joints and loads of the others follow from each other. After a step of all commands, by which joints
push each other, a simulated leg was off by 7.6, 0.7, 0.5 and 0.1 mrad after one to four of them."""

PASSES = 2  # Times that joints are fitted to loads that follow from the fits of the others
WORSE = 0.01  # Share by which the error of a joint may rise when offsets are made to agree: as much as searches end apart
LATE = 0.1  # The same for one delay of all joints: of a leg whose joints have one and friction by the load it is .04
UNLOADED = JointLoad(*(np.zeros(()) for _ in range(4)))  # stands in while columns are checked


class JointsLog(NamedTuple):
    """A log of all joints: its name, its columns, what is known of each servo, and the links with what they carried."""

    name: str
    columns: ServoColumns
    servos: tuple[Servo, ...]
    links: Robot


@dataclass(frozen=True, eq=False)
class Joints:
    """Joints of a robot, by their numbers."""

    links: Robot
    """The robot without its drives."""
    logs: tuple[JointsLog, ...]
    """What was logged."""

    @cached_property
    def runs(self) -> list[list[ServoRun]]:
        """Runs of each joint, while the others move as they were measured."""
        return self._loaded([{}] * len(self.logs))

    def runs_with(self, fits: Mapping[int, ServoFit]) -> list[list[ServoRun]]:
        """Runs of each joint, while others that have a fit move as simulated, corrected by the measured slow motion."""
        if self.links.n == 1 or not fits:
            return self.runs
        key = tuple((j, fits[j]) for j in sorted(fits))
        if key not in self._swept:
            self._swept[key] = self._sweep(fits)
        return self._swept[key]

    @cached_property
    def _swept(self) -> dict[tuple[tuple[int, ServoFit], ...], list[list[ServoRun]]]:
        """Runs with the loads of fits that were asked for: they take a second each time."""
        return {}

    def _sweep(self, fits: Mapping[int, ServoFit]) -> list[list[ServoRun]]:
        """Runs whose loads follow from the motions of the others, and these from their loads, while they come closer."""
        runs, before = self.runs, list[dict[int, Moving]]()
        change = np.inf
        for _ in range(SWEEPS):
            moving = self._moving(fits, runs)
            each = zip(before, moving, strict=True) if before else ()  # largest mean difference over joints and logs [rad]
            apart = max((float(np.abs(a[j].q - b[j].q).mean()) for a, b in each for j in a), default=change)
            if apart > change:  # joints that saturate may push each other apart
                break
            runs = self._loaded(moving)
            before, change = moving, apart
        return runs

    def identified(
        self, identify: Callable[[int, Sequence[ServoRun]], Identified], motors: Sequence[Sequence[int]] = ()
    ) -> Iterator[tuple[int, Identified | str]]:
        """Yield the result of each joint, or why it has none; joints of an arm come again when more is known.

        Encoder counts hide accelerations. Joints are therefore fitted a second time, starting from their first estimates, to
        loads that follow from the fits of the others. A joint whose torques have no scale still moves as its fit simulates.
        Then all offsets are made to agree, and joints with the same motor, by their numbers, are tied.
        """
        moving = dict[int, ServoFit]()
        for j, (joint, runs) in enumerate(zip(self.links.joints, self.runs, strict=True)):
            if self.links.slides[j] and runs[0].servo.kind == Servo.kind:
                yield j, f"{joint} slides: gain and counts of servo.toml are those of a joint that turns"
                continue
            with stage(joint):
                result, fit = _attempt(partial(identify, j, runs))
            if fit is not None:
                moving[j] = fit
            yield j, result
        if len(moving) < 2:
            return
        before, known = moving, moving
        for _ in range(PASSES):
            before, known = known, dict[int, ServoFit]()
            every = self.runs_with(before)
            for j, fit in before.items():
                with stage(f"{self.links.joints[j]}, while the others move as their servos do"):
                    again, found = _attempt(partial(identify_again, fit, every[j]))
                if found is not None and not isinstance(again, str):
                    known[j] = found
                yield j, again
        with stage("offsets of all joints"):
            agreed = self._agreed(before, known)
        with stage("one delay of all joints"):  # that of a message, unless the log says otherwise
            late = tied(agreed, ("delay",))
            agreed = late if self._as_well(late, agreed, LATE) else agreed
            yield from agreed.items()
        for motor in motors:
            with stage(f"one motor of {', '.join(self.links.joints[j] for j in motor)}"):
                yield from tied({j: agreed[j] for j in motor if j in agreed}).items()

    def _agreed(self, before: Mapping[int, ServoFit], fits: Mapping[int, ServoFit]) -> dict[int, ServoFit]:
        """Fits whose offsets agree, or as they are where a joint is simulated less well with these."""
        moved = self._together(before, fits)
        if self._as_well(moved, fits):
            return moved
        return {j: replace(fit, of_all=moved[j].of_all) for j, fit in fits.items()}

    def _as_well(self, moved: Mapping[int, ServoFit], fits: Mapping[int, ServoFit], worse: float = WORSE) -> bool:
        """True if no joint's mean error is larger than with other fits, by more than a share."""
        runs = [self.runs_with(some) for some in (moved, fits)]
        return all(
            np.mean(moved[j].errors(runs[0][j])) <= (1 + worse) * np.mean(fit.errors(runs[1][j])) for j, fit in fits.items()
        )

    def _together(self, before: Mapping[int, ServoFit], fits: Mapping[int, ServoFit]) -> dict[int, ServoFit]:
        """Fits whose offsets agree, of some whose loads assume the offsets of the fits before."""
        joints = {j: OffsetJoint(fit, {}) for j, fit in fits.items()}
        moving = list[dict[int, Moving]]()
        for log, each in zip(self.logs, self._moving(before, self.runs_with(before)), strict=True):
            t = log.columns.t
            moving.append({j: m._replace(t=t, q=np.interp(t, m.t, m.q)) for j, m in each.items()})
        assumed = {k: fit.offset for k, fit in before.items() if k in fits and fit.scaled}
        now = self._loaded(moving)
        for k, offset in assumed.items():
            runs = self._loaded([{**each, k: each[k]._replace(offset=offset + APART)} for each in moving])
            for j, (fit, changes) in joints.items():
                if j != k:
                    late = before[j].p["delay"]
                    changes[k] = per_offset(fit, searched_runs(now[j], late), searched_runs(runs[j], late))
        return together(joints, assumed)

    def _moving(self, fits: Mapping[int, ServoFit], runs: Sequence[Sequence[ServoRun]]) -> list[dict[int, Moving]]:
        """Simulated motion of joints with these loads, in each log."""
        return [
            {
                j: Moving(*fit.fine(runs[j][k]), fit.offset, fit.p["Ia"], fit.taken_late, fit.servo.steps.early)
                for j, fit in fits.items()
            }
            for k in range(len(self.logs))
        ]

    def _loaded(self, moving: Sequence[Mapping[int, Moving]]) -> list[list[ServoRun]]:
        """Runs of each joint while the others move so, or as they were measured."""
        every = [[] for _ in self.links.joints]  # type: list[list[ServoRun]]
        for log, by_fits in zip(self.logs, moving, strict=True):
            for j in range(self.links.n):
                self._run(log, j, UNLOADED)  # raises LogError before loads are computed from a bad log
            for j, load in enumerate(loads(log.links, log.columns, by_fits)):
                every[j].append(self._run(log, j, load))
        return every

    def _run(self, log: JointsLog, j: int, load: JointLoad) -> ServoRun:
        columns, name = log.columns, f"{log.name}, {self.links.joints[j]}"
        others = columns.on, columns.voltage, columns.forward
        on, voltage, forward = (None if x is None else x[:, j] for x in others)
        if columns.velocity is not None:  # kd (v - qd)
            forward = (0.0 if forward is None else forward) + log.servos[j].kd * columns.velocity[:, j]
        low, high = self.links.ranges[j]
        measured = columns.t, columns.q[:, j], columns.command[:, j]
        enabled = None if on is None else on > 0.5
        return ServoRun(*measured, load, log.servos[j], enabled, voltage, forward, (low, high), name=name)


def _attempt(identify: Callable[[], Identified]) -> tuple[Identified | str, ServoFit | None]:
    """Identified servo or reason for none, and the fit that moves the joint, if there is one."""
    try:
        result = identify()
    except IdentificationError as error:
        return str(error), None
    fit = result.fit if isinstance(result, ServoFrictionChoice) else result
    return result, fit if fit.explained else None
