"""The job `excite`: a request becomes a design, and that an exciting motion, or several, each for what is still open."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from idbench.experiments.errors import ExperimentError
from idbench.experiments.excite.design import Design
from idbench.experiments.excite.excited import Excited
from idbench.experiments.identification.known import number_of
from idbench.experiments.identification.reading import file_of, read
from idbench.experiments.identification.robot_model import RobotModel, absolute
from idbench.experiments.requests.jobs import ExciteRequest
from idbench.experiments.requests.shared import LogRequest
from idbench.identify import Array, Estimate, ExplicitModel, MotionLog, TorqueChannel, brisk_shares, identify
from idbench.sim.encoders import IncrementalEncoder
from idbench.sim.engine.simulation import Progress, simulate
from idbench.sim.limits.motion_limits import MotionLimits, limits_of
from idbench.sim.scenario.measurement import TorqueMeasurement
from idbench.sim.scenario.scenario import Scenario
from idbench.sim.scenario.scenario_file import load

ENOUGH = 0.1  # Weight of a parameter that is known well enough
ROUNDS = 12  # Motions after which it ends, whatever is known


@dataclass(frozen=True, eq=False)
class Round:
    """A motion, its log, and what all logs so far say."""

    excited: Excited
    """The motion."""
    log: MotionLog
    """What was logged."""
    estimate: Estimate
    """Parameters from all logs so far."""
    shares: Array
    """What one sigma of each parameter makes of a brisk motion's torque, shape (p,)."""

    @property
    def share(self) -> float:
        """The largest of the shares."""
        return float(self.shares.max())

    @property
    def weakest(self) -> str:
        """The parameter that has it."""
        return self.excited.design.robot_model.basis.names[int(self.shares.argmax())]


@dataclass(frozen=True, eq=False)
class MotionSequence:
    """Motions until every parameter is known well enough."""

    rounds: tuple[Round, ...]
    """One a motion."""
    wished: float
    """Share that was asked for."""
    interrupted: bool = False
    """Whether it was ended before its time."""

    @classmethod
    def of(cls, design: Design, wished: float, progress: Progress | None = None) -> "MotionSequence":
        """Design, simulate and identify until one sigma of each parameter makes less than `wished` of a brisk torque.

        After ROUNDS motions, or Ctrl-C, it ends with what there is.
        """
        rounds, weights = list[Round](), design.weights
        logs, model = design.logs, design.robot_model
        try:
            for number in range(ROUNDS):
                excited = Excited.of(replace(design, logs=logs, seed=design.seed + number, weights=weights), progress)
                logs = (*logs, simulate(replace(excited.scenario, seed=design.scenario.seed + number)).alone())
                estimate = identify(logs, model.basis, ExplicitModel())
                shares = brisk_shares(model.tree, model.basis, estimate.X, estimate.standard_errors)
                rounds.append(Round(excited, logs[-1], estimate, shares))
                if rounds[-1].share < wished or excited.interrupted:
                    break
                each = zip(model.basis.names, shares, strict=True)  # what is not known well enough counts as much more
                weights = {name: float(design.weights.get(name, 1.0) * max(ENOUGH, x / wished)) for name, x in each}
        except KeyboardInterrupt:
            if not rounds:
                raise
            return cls(tuple(rounds), wished, interrupted=True)
        return cls(tuple(rounds), wished, rounds[-1].excited.interrupted)

    @property
    def reached(self) -> bool:
        """Whether every parameter is known well enough."""
        return self.rounds[-1].share < self.wished

    def summary(self) -> dict[str, Any]:
        """Its part of summary.json."""
        return {"until": self.wished, "reached": self.reached, "rounds": [_summary(each) for each in self.rounds]}


def _summary(found: Round) -> dict[str, Any]:
    X, sigma = found.estimate.X.tolist(), found.estimate.standard_errors.tolist()
    return {"brisk_share": found.share, "weakest": found.weakest, "estimate": X, "sigma": sigma}


LONGEST, FASTEST = 3600.0, 10000.0
"""Time of a motion, repeated [s], and sampling frequency [Hz] above which they are taken for a slip."""

BITS = 17.0  # Resolution of the encoders without a scenario [bits]
TORQUE_NOISE = (0.05,)  # Rms noise of the torques without a scenario [N m]
QUIET = 1e-6  # Rms noise of a torque below which a number is taken for a slip [N m]
LOUD = 1e6  # The same above which it is [N m]


def excited(asked: ExciteRequest, progress: Callable[[float], None]) -> tuple[Excited, MotionSequence | None]:
    """Return the motion that is designed, the last of a sequence where one is asked for, and that sequence.

    ExperimentError, IdentificationError or BenchError if something is wrong with the request, or no motion keeps the limits.
    """
    design = designed(asked)
    if asked.until is None:
        return Excited.of(design, progress), None
    share = (number_of(asked.until.removesuffix("%")) or 0.0) / 100
    if not 0 < share < 1:
        raise ExperimentError(f"--until {asked.until}: give a share between 0 and 100 %, such as 0.1%")
    sequence = MotionSequence.of(design, share, progress)
    return sequence.rounds[-1].excited, sequence


def designed(asked: ExciteRequest) -> Design:
    """The checked design."""
    if asked.fs is not None:
        _require_between("fs", asked.fs, 10, FASTEST)
    scenario = _scenario(asked)
    _require_between("duration", asked.duration, 0, LONGEST)
    _require_between("frequency", asked.frequency, 0, scenario.fs / 4)
    _require_between("repeat", asked.repeat, 1, max(1.0, LONGEST // asked.duration))
    if asked.seed < 0:
        raise ExperimentError(f"--seed {asked.seed} must be at least 0")
    if asked.parameters.prior:
        raise ExperimentError(
            "--prior is for logs: a motion is designed for what it shows by itself; leave --prior out, or --hold what is known"
        )
    if asked.until is not None and asked.log:
        raise ExperimentError("--until simulates its own logs: leave --log out")
    robot_model, limits = RobotModel(absolute(asked.robot), asked.parameters), _limits(asked)
    limits_of(robot_model.robot, limits)  # what is missing is said before the parameters are grouped
    robot_model.require_linear()
    n, count = robot_model.robot.n, len(asked.torque_noise)
    if count not in (0, 1, n):
        raise ExperimentError(f"--torque-noise has {count} values for {n} joints: give one for all, or one per joint")
    return Design(
        robot=absolute(asked.robot),
        scenario=scenario,
        kind=asked.kind,
        duration=asked.duration,
        frequency=asked.frequency,
        asked=limits,
        repeat=asked.repeat,
        seed=asked.seed,
        weights=_weights(asked.weigh),
        criterion=asked.criterion,
        # Of the torques of earlier logs nothing counts, so that their meaning is not asked for.
        logs=tuple(read(file_of(path), LogRequest(), robot_model, TorqueChannel("held")).longest for path in asked.log),
        parameters=asked.parameters,
    )


def _require_between(name: str, value: float, least: float, most: float) -> None:
    if not (least <= value <= most and value > 0):
        above = f"at least {least:g}" if least else "above 0"
        raise ExperimentError(f"--{name} {value:g} must be {above} and at most {most:g}")


def _limits(asked: ExciteRequest) -> MotionLimits:
    """Limits of a motion: asked ones before the file of --limits."""
    limits = MotionLimits.read(asked.limits)
    for name in ("velocity", "acceleration"):
        values: tuple[float, ...] = getattr(asked, name)
        if wrong := [x for x in values if not 0 < x < float("inf")]:
            raise ExperimentError(f"--{name} {wrong[0]:g} must be a number above 0")
        if values:
            limits = replace(limits, **{name: values})  # type: ignore[arg-type]  # of one of these names
    return limits


def _scenario(asked: ExciteRequest) -> Scenario:
    """Scenario of noise and simulation: asked settings before its own."""
    scenario = load(asked.noise or "ideal")
    bits = asked.encoder_bits if asked.encoder_bits is not None or asked.noise else BITS
    noise = asked.torque_noise or (() if asked.noise else TORQUE_NOISE)
    if bits is not None:
        _require_between("encoder-bits", bits, 4, 40)
        scenario = replace(scenario, encoder=IncrementalEncoder(lines=(max(1, round(2**bits / 4)),)))
    if noise:
        if not all(QUIET <= x <= LOUD for x in noise):
            given = " ".join(f"{x:g}" for x in noise)
            raise ExperimentError(f"--torque-noise {given} must be at least {QUIET:g} and at most {LOUD:g} N m")
        scenario = replace(scenario, torque=TorqueMeasurement(noise=noise))
    elif not max(scenario.torque.noise):
        raise ExperimentError(f"scenario {asked.noise} has no torque noise: add --torque-noise, such as 0.05")
    return scenario if asked.fs is None else replace(scenario, fs=asked.fs)


def _weights(given: tuple[str, ...]) -> Mapping[str, float]:
    """Return weights by the names of parameters; raise ExperimentError if one is no number above 0."""
    found = dict[str, float]()
    for text in given:
        name, _, value = text.partition("=")
        if name in found:
            raise ExperimentError(f"--weigh gives {name} twice")
        found[name] = number_of(value) or 0.0
        if not 1e-6 <= found[name] <= 1e6:
            raise ExperimentError(f"--weigh {text}: give a parameter and a weight from 1e-6 to 1e6, such as LMY2=4")
    return found


PARTS = "part: 0 the way from home to the start, 1 the motion, with its rest at both ends, 2 the way back"
"""What stands in the first line of the file of a motion."""


def write_motion(found: Excited, path: Path) -> None:
    """Write time [s], part, positions [rad], velocities and accelerations of joints as CSV, at the controller's frequency."""
    fs, joints = found.design.scenario.fs, found.design.robot_model.robot.joints
    part, motion = found.planned(fs)
    names = ["t", "part", *(f"{letters}_{joint}" for letters in ("q", "qd", "qdd") for joint in joints)]
    table = np.column_stack([np.arange(len(part)) / fs, part, motion.q, motion.qd, motion.qdd])
    formats = ["%.6f", "%d", *["%.9g"] * (3 * len(joints))]
    np.savetxt(path, table, delimiter=",", header=f"# {PARTS}\n{','.join(names)}", comments="", fmt=formats)
