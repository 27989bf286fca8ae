"""The design of a motion: what is asked, what random motions reach, what the search finds."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from math import ceil

import numpy as np

from idbench.experiments.errors import ExperimentError
from idbench.experiments.excite.excitation import EXCITATIONS, AbstractExcitation
from idbench.experiments.excite.limit_use import FS, LimitUse
from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.requests.shared import Parameters
from idbench.identify import CHAINS, Array, FirLowPass, MotionLog, NoiseLevels
from idbench.identify.data.kinematics import Limits
from idbench.identify.design.criteria import CRITERIA, AbstractCriterion, LogSigma
from idbench.identify.design.information import Information, predicted_information
from idbench.identify.design.plan import Plan
from idbench.identify.noise.linearization import slopes
from idbench.identify.parameters.base_parameters import columns_at, random_states
from idbench.identify.plugins import did_you_mean
from idbench.sim.limits.clearance import Clearance
from idbench.sim.limits.motion_limits import BOX, CLEARANCE, FLOOR, MotionLimits, home_position, limits_of, surroundings
from idbench.sim.robot.inverse_dynamics import coulomb_torque, inverse_dynamics
from idbench.sim.scenario.scenario import Scenario
from idbench.sim.trajectories.time_optimal import approach
from idbench.sim.trajectories.trajectory import AbstractTrajectory, Reference

SIGMA, DETERMINANT = "sigma", "determinant"  # What is minimised by default, and what that begins with
RANDOM, DRAWS = 60, 600  # Random motions that a motion is compared with, and draws after which fewer will do
PREDICTED = 100.0  # Frequency [Hz] at which sigmas are predicted, with the noise that a faster log has in this band
TOGETHER = 10  # Motions whose sigmas are predicted together

WAY, MOST = 0.9, 1e3
"""Share of the limits that the ways from home and back may use, and what stands for a limit that there is not."""

PACES = 1.0, 0.3, 0.1  # Shares of that, the first for which torques keep their limits

STATES, LEAST = 12.0, 8.0  # States for each period of the highest frequency, and least states a second
MANY = 400  # Most periods of the highest frequency: slopes of more take hours
FINER = 4  # Instants at which limits are kept, for each state
POSTURES = 200  # Random postures over which inertia is averaged
BLOCK = 2000  # States whose columns are made together
PASS = FirLowPass().cutoff  # End of the pass band of the rows [Hz]


@dataclass(frozen=True, eq=False)
class Design:
    """What is asked of a motion."""

    robot: str
    """Its name or file."""
    scenario: Scenario
    """Noise, sampling frequency, and how it will be simulated; its trajectory does not matter."""
    kind: str = "fourier"
    """Of motion, of `EXCITATIONS`."""
    duration: float = 10.0
    """Time of the motion, without ways and rest [s]."""
    frequency: float = 1.0
    """How fast it may change [Hz]."""
    asked: MotionLimits = field(default_factory=MotionLimits)
    """What it must keep."""
    repeat: int = 1
    """Times that it is run."""
    seed: int = 0
    """Of random motions and starts."""
    weights: Mapping[str, float] = field(default_factory=dict)
    """Parameters that count more than others, or less; all count 1."""
    criterion: str = SIGMA
    """What is minimised: of `CRITERIA`, or sigma, the weighted mean of ln sigma, begun with the determinant."""
    logs: tuple[MotionLog, ...] = ()
    """What is logged already."""
    parameters: Parameters = Parameters()  # noqa: RUF009  # frozen
    """Which parameters are asked for."""

    def __post_init__(self) -> None:
        names = self.robot_model.basis.names
        if name := next((name for name in self.weights if name not in names), None):
            raise ExperimentError(f"--weigh {name}: no such parameter{did_you_mean(name, names)}; known: {', '.join(names)}")
        if self.weights and self.criterion != SIGMA:
            raise ExperimentError(f"--weigh needs the criterion sigma, not {self.criterion}")
        if self.criterion not in (known := (SIGMA, *CRITERIA)):
            hint = did_you_mean(self.criterion, known)
            raise ExperimentError(f"--criterion {self.criterion}: no such criterion{hint}; known: {', '.join(known)}")
        for log in self.logs:
            if log.n != self.robot_model.robot.n:
                raise ExperimentError(f"an earlier log has {log.n} joints, robot {self.robot} {self.robot_model.robot.n}")

    @cached_property
    def robot_model(self) -> RobotModel:
        """The robot."""
        return RobotModel(self.robot, self.parameters)

    @cached_property
    def excitation(self) -> AbstractExcitation:
        """The kind of motion."""
        return EXCITATIONS.create(self.kind)

    @cached_property
    def limits(self) -> Limits:
        """Limits of the joints."""
        return limits_of(self.robot_model.robot, self.asked)

    @cached_property
    def home(self) -> Array:
        """Where the arm comes from [rad], shape (joint,)."""
        return home_position(self.robot_model.robot, self.asked, self.limits)

    @cached_property
    def clearance(self) -> Clearance:
        """Distances of shapes, from each other and from obstacles."""
        found = Clearance(surroundings(self.robot, self.asked), self.limits.position, self.asked.clearance)
        wanted = [BOX.format(box.name) for box in self.asked.keep_out]
        wanted += [FLOOR] if isinstance(self.asked.floor, float) else []
        if wanted and not found.checks:
            raise ExperimentError(f"{wanted[0]}: nothing is known of the shapes of {self.robot}: take it out of the limits")
        for pair in found.left_out:
            if thing := next((name for name in wanted if name in pair), None):
                (other,) = set(pair) - {thing}
                where = f"inside it, or nearer than {1000 * self.asked.clearance:.0f} mm, whatever the posture"
                raise ExperimentError(f"{thing}: {other} is {where}: move it, or make it smaller")
        self._require_reachable(found)
        if touch := found.nearest(self.home[None], 0 * self.home[None], FS):
            way_out = "give another home, or a smaller clearance, in a file of --limits"
            raise ExperimentError(f"home = {np.round(self.home, 3).tolist()}: {touch}; {way_out}")
        return found

    def _require_reachable(self, found: Clearance) -> None:
        """Raise ExperimentError if a distance is asked for that some shapes never have: what touches anyway is left out."""
        if self.asked.clearance <= CLEARANCE:
            return
        short = [(far, pair) for far, pair in zip(found.farthest, found.left_out, strict=True) if far > CLEARANCE]
        if short:
            far, (one, other) = min(short)
            more = f" (and {len(short) - 1} more pairs are too near)" if len(short) > 1 else ""
            raise ExperimentError(
                f"clearance = {self.asked.clearance:g} m: {one} and {other} are never more than {far:.2g} m apart, whatever "
                f"the posture{more}: give at most {far:.2g} in the file of --limits; {CLEARANCE:g} is the default"
            )

    def require_home(self) -> None:
        """Raise ExperimentError if limits are broken where the arm comes from, at rest."""
        q = np.repeat(self.home[None], 2, axis=0)
        if broken := next(self.use_of(Reference(FS, q, 0 * q, 0 * q)).broken(), None):
            what = f"at home, at rest, {broken.partition(' at ')[0]}"
            raise ExperimentError(f"{what}: give another home, or a larger torque_share, in a file of --limits")

    @cached_property
    def X(self) -> Array:
        """Parameters as the robot's file has them."""
        return np.array(list(self.robot_model.truth(self.robot_model.robot).values()))

    @cached_property
    def levels(self) -> NoiseLevels:
        """Noise of the log."""
        n = self.robot_model.robot.n
        levels = NoiseLevels(self.scenario.torque.spread(n), self.scenario.encoder.spread(n))
        if not (levels.torque > 0).all():
            raise ExperimentError("sigmas need a noise of the torques above 0 N m: give --torque-noise, or another --noise")
        return levels

    @cached_property
    def known(self) -> Array:
        """Information of earlier logs, shape (p, p)."""
        p, chain = len(self.X), CHAINS.create("idbench")
        each = [predicted_information(log, self.robot_model.basis, self.X, self.levels, chain) for log in self.logs]
        return np.sum(each, axis=0) if each else np.zeros((p, p))

    @cached_property
    def plan(self) -> Plan:
        """What the search minimises; raise ExperimentError if the motion is too short for the parameters."""
        self._require_enough()
        moves = max(1, round(self.duration * self.frequency))
        if moves > MANY:
            raise ExperimentError(f"{moves} periods of {self.frequency:g} Hz are more than {MANY}: give a shorter --duration")
        count = moves * ceil(max(LEAST, STATES * self.frequency) * self.duration / moves)  # where moves begin, jerk peaks
        rate = count / self.duration
        grids = (np.arange(count) + 0.5) / rate, np.arange(FINER * count) / (FINER * rate)
        states, instants = (self.excitation.shapes(np.asarray(t), self.duration, self.frequency) for t in grids)
        noise = self.first_criterion.noise
        return Plan(
            information=self._information(rate, noise),
            criterion=self.first_criterion,
            limits=self.limits,
            states=states,
            instants=instants,
            X=self.X,
            known=self.known if noise else np.zeros_like(self.known),
            prior_error=self.asked.prior_error,
            torque_share=self.asked.torque_share,
            repeat=self.repeat,
            home=self.home,
            obstacles=self.clearance.cost if self.clearance.checks else None,
        )

    def _require_enough(self) -> None:
        p, rows = len(self.X), 2 * PASS * self.duration * self.robot_model.robot.n
        if rows < p:
            raise ExperimentError(
                f"{self.duration:g} s make {rows:.0f} rows behind a filter at {PASS:g} Hz, fewer than the {p} parameters: "
                f"give a --duration of at least {ceil(max(4 * p / rows * self.duration, 3 / self.frequency))} s"
            )

    def _information(self, rate: float, noise: bool) -> Information:
        """Return the information of motions, with their noise, or as if all rows were alike."""
        basis, n, fs = self.robot_model.basis, self.robot_model.robot.n, self.scenario.fs
        levels = self.levels if noise else NoiseLevels(np.ones(n), np.zeros(n))
        q, qd, qdd = random_states(self.robot_model.tree, POSTURES)
        inertia = np.asarray(slopes(basis, self.X, q, qd, qdd, qd).inertia.mean(axis=-1))  # M(q), on average over postures
        return Information(basis, levels, inertia, fs, rate, min(PASS, fs / 2))

    @property
    def first_criterion(self) -> AbstractCriterion:
        """What the search begins with: the determinant, which leads far from anywhere, unless some parameters count more."""
        if self.criterion == SIGMA and self.weights:
            return self.sigma_criterion
        return CRITERIA[DETERMINANT if self.criterion == SIGMA else self.criterion]

    @cached_property
    def sigma_criterion(self) -> LogSigma:
        """The mean of ln sigma, weighted as asked."""
        weights = np.array([self.weights.get(name, 1.0) for name in self.robot_model.basis.names])
        return LogSigma(tuple(weights / weights.sum()))

    def trajectory(self, c: Array, repeat: int | None = None) -> AbstractTrajectory:
        """Return the trajectory of coefficients."""
        scaled = self.plan.coefficients(c)
        return self.excitation.trajectory(scaled, self.limits.middle, self.duration, repeat or self.repeat)

    def information(self, each: list[Array]) -> Array:
        """Return the information of motions, as generalized least squares has it, and of earlier logs, shape (motion, p, p)."""
        fs, found = min(PREDICTED, self.scenario.fs), []
        share = np.sqrt(fs / self.scenario.fs)
        levels = NoiseLevels(self.levels.torque * share, self.levels.position * share)
        for i in range(0, len(each), TOGETHER):
            some = each[i : i + TOGETHER]
            q = np.stack([self.trajectory(c, 1).motion(self.robot_model.robot).sample(fs).q for c in some])
            log = MotionLog(fs, q, np.zeros_like(q), self.scenario.channel)
            found.append(predicted_information(log, self.robot_model.basis, self.X, levels, CHAINS.create("idbench")))
        return self.known + self.repeat * np.concatenate(found)

    def random_motions(self) -> tuple[list[Array], int]:
        """Return coefficients of random motions that keep the limits, and how many were drawn."""
        rng = np.random.default_rng([self.seed, 1])
        kept, drawn = list[Array](), 0
        while len(kept) < RANDOM and drawn < DRAWS:
            c, drawn = self.excitation.random(rng, self.plan, self.duration, self.frequency), drawn + 1
            if self.plan.excess(c) == 0:
                kept.append(c)
        return kept, drawn

    def ways(self, c: Array, fs: float, pace: float) -> tuple[Reference, Reference]:
        """Return the ways from home to where a motion starts, and back, sampled at `fs` [Hz], at a share of the limits."""
        start = self.trajectory(c, 1).motion(self.robot_model.robot).at(np.zeros(1), fs).q[0]
        most = np.stack([self.limits.velocity, self.limits.acceleration, self.limits.jerk])
        there = approach(self.robot_model.robot, self.home, start, fs, WAY * pace * np.where(np.isfinite(most), most, MOST))
        return there, Reference(fs, there.q[::-1], -there.qd[::-1], there.qdd[::-1])

    def pace(self, c: Array) -> float:
        """Speed scale of the ways to and from home: slower where their torques would be too large."""
        for pace in PACES:
            if not any(broken for way in self.ways(c, FS, pace) for broken in self.use_of(way).broken()):
                break
        return pace

    def look(self, c: Array) -> LimitUse:
        """Use of the limits by a motion."""
        return self.use_of(self.trajectory(c, 1).motion(self.robot_model.robot).sample(FS))

    def use_of(self, motion: Reference) -> LimitUse:
        """Use of the limits by a motion that is sampled at FS."""
        robot = self.robot_model.robot
        limits = self.limits
        rates = {"velocity": motion.qd, "acceleration": motion.qdd, "jerk": np.gradient(motion.qdd, 1 / FS, axis=0)}
        shares = {"position": np.abs(motion.q - limits.middle) / limits.sizes[0]}
        shares |= {name: np.abs(x) / getattr(limits, name) for name, x in rates.items()}
        tau = inverse_dynamics(robot, motion.q, motion.qd, motion.qdd) + coulomb_torque(robot, motion.qd)
        shares["torque"] = np.abs(tau) / (self.asked.torque_share * limits.torque)
        shares["worst-case torque"] = (np.abs(tau) + self.asked.prior_error * self._spread(motion)) / limits.torque
        moves = motion.qd.any(axis=1)  # of a motion that is repeated, rest is at the ends alone
        squares = np.mean(tau[moves] ** 2, axis=0, keepdims=True) if moves.any() else 0 * tau[:1]
        shares["rms torque"] = np.sqrt(squares) / limits.rms_torque
        limited = {name: share for name, share in shares.items() if share.any()}
        return LimitUse(limited, self.clearance.nearest(motion.q, motion.qd, FS), self.asked.clearance, robot.joints)

    def _spread(self, motion: Reference) -> Array:
        """Return the torques that all parameters make together if none were opposed, shape (time, joint) [N m]."""
        blocks = [slice(i, i + BLOCK) for i in range(0, len(motion.q), BLOCK)]
        states = np.stack([motion.q, motion.qd, motion.qdd]).swapaxes(-1, -2)
        columns = (columns_at(self.robot_model.basis, states[..., b]) for b in blocks)
        return np.concatenate([np.einsum("jpt,p->tj", np.abs(x), np.abs(self.X)) for x in columns])
