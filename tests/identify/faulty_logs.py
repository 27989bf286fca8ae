"""Logs with one fault each of those that a scenario can have, whose torques are MuJoCo's inverse dynamics."""

from copy import copy
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import scipy.signal

from idbench.experiments.study.named_faults import is_named
from idbench.identify import (
    ESTIMATORS,
    MODELS,
    Array,
    BaseParameters,
    MotionLog,
    Problem,
    TorqueChannel,
    estimate,
    idbench_chain,
)
from idbench.identify.arrays import TINY
from idbench.identify.basis import tree_basis
from idbench.identify.basis.basis import Basis
from idbench.identify.judge.diagnosis import diagnosed, silent_joint
from idbench.identify.judge.suspect import Suspect
from idbench.identify.signals.signals import State
from idbench.sim.robot.inverse_dynamics import coulomb_torque, inverse_dynamics
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.tree import kinematic_tree
from idbench.sim.scenario.faults import FAULTS, Fault, with_faults

FS = 100.0

NULLS: dict[str, dict[str, float]] = {
    "plain": {},
    "12 bits": {"bits": 12.0},
    "coloured 2 %": {"colour": 2.0},
    "slow": {"speed": 0.2},
    "short": {"time": 10.0},
}
"""Logs without a fault: what is unusual about them."""


@dataclass
class Lab:
    """A robot on five sines a joint, with friction of 15 % of its torques."""

    name: str
    seed: int
    time: float = 30.0
    speed: float = 1.0
    rng: np.random.Generator = field(init=False)

    def __post_init__(self) -> None:
        self.rng, robot = np.random.default_rng([self.seed, 7]), Robot.load(self.name)
        n, t = robot.n, np.arange(0, self.time, 1 / FS)
        w = 2 * np.pi * 0.1 * self.speed * np.arange(1, 6)[:, None, None]
        a, b = (self.rng.standard_normal((5, n, 1)) / np.arange(1, 6)[:, None, None] for _ in range(2))
        limits = np.where(robot.model.jnt_limited[:, None], robot.model.jnt_range, [-2.0, 2.0])
        q = np.sum(a * np.sin(w * t) + b * np.cos(w * t), axis=0)
        size = (np.minimum(0.4 * np.ptp(limits, axis=1), 1.0) / np.abs(q).max(axis=1))[:, None]
        middle = np.clip(limits.mean(axis=1), -1.0, 1.0)[:, None]
        qd = size * np.sum(w * (a * np.cos(w * t) - b * np.sin(w * t)), axis=0)
        qdd = size * np.sum(-(w**2) * (a * np.sin(w * t) + b * np.cos(w * t)), axis=0)
        self.t, self.true = t, ((middle + size * q).T, qd.T, qdd.T)
        self.robot = replace(robot, model=copy(robot.model))
        self.robot.model.dof_damping[:] = self.robot.model.dof_frictionloss[:] = 0.0
        level = np.sqrt(np.mean(inverse_dynamics(self.robot, *self.true) ** 2, axis=0))
        self.robot.model.dof_frictionloss[:] = 0.15 * level * self.rng.uniform(0.7, 1.3, n)
        rms = np.sqrt(np.mean(qd**2, axis=1))
        self.robot.model.dof_damping[:] = 0.15 * level * self.rng.uniform(0.7, 1.3, n) / rms

    @property
    def tau(self) -> Array:
        """Torques of links, rotors and friction, shape (time, joint)."""
        return inverse_dynamics(self.robot, *self.true) + coulomb_torque(self.robot, self.true[1])

    @cached_property
    def basis(self) -> Basis:
        """Base parameters, with a rotor at each joint."""
        tree = kinematic_tree(Robot.load(self.name))
        tree = replace(tree, joints=tuple(replace(joint, armature=True) for joint in tree.joints))
        return BaseParameters.of(tree, tree_basis(tree)).basis

    def log(self, noise: float, *faults: Fault, bits: float = 17.0, colour: float = 0.0) -> MotionLog:
        """Counts, and noise of shares of each torque [%], white and correlated over half a second."""
        exact = MotionLog(FS, self.true[0], self.tau, TorqueChannel("instantaneous"))
        faulty = with_faults(self.robot, exact, self.true, faults, self.rng)
        step, level = 2 * np.pi / 2**bits, np.sqrt(np.mean(faulty.tau**2, axis=0)) / 100
        tau = faulty.tau + noise * level * self.rng.standard_normal(faulty.tau.shape)
        if colour:
            a = np.exp(-1 / (FS * 0.5))
            slow = scipy.signal.lfilter([np.sqrt(1 - a**2)], [1, -a], self.rng.standard_normal(faulty.tau.shape), axis=0)
            tau = tau + colour * level * slow
        return replace(faulty, q=np.round(faulty.q / step) * step, tau=tau)


def sizes(true: tuple[Array, Array, Array], tau: Array, mass: float, j: int, seconds: float) -> dict[str, float]:
    """Sizes of faults at a joint, from what it does; `mass` is that of the last link."""
    L, Q, V, A = (float(np.std(x[:, j])) for x in (tau, *true))
    return {
        "gain": 0.2, "offset": 0.3 * L, "drift": 0.3 * L / seconds, "saturation": 0.6, "falling-constant": 0.3,
        "dead-band": 0.15 * L, "delay": 0.01, "position-delay": 0.03, "zero": 0.08, "scale": 0.05, "eccentric": 0.03,
        "coupled-rotor": 0.2 * L / A, "spring": 0.5 * L / Q, "load-friction": 0.15, "stribeck": 0.2 * L,
        "asymmetry": 0.15 * L / V, "warming": 0.5, "hysteresis": 0.15 * L, "cogging": 0.1 * L, "commutation": 0.1,
        "backlash": 0.01, "elasticity": 0.02 / L, "push": 3 * L, "unlogged": L, "length": 0.03, "axis": 0.05,
        "payload": 0.2 * mass, "tilt": 0.3, "base-motion": 1.0, "rate": 0.1, "clock-drift": 8e-4, "dropouts": 0.05,
    }  # fmt: skip


WHEN = {"payload": (8.0, None), "push": (8.0, 8.4)}
"""From when to when some are there [s]."""

REFUSED = {"degrees", "dropouts"}
"""Faults of which the reader of files speaks, not the residuals of a fit."""

KINDS = tuple(kind for kind in FAULTS if kind not in REFUSED | {"rotor"})  # rotors are identified


@dataclass
class Case:
    """A log of a robot with a fault, or without one."""

    robot: str
    noise: float
    kind: str = ""
    """Of the fault; none by default."""
    seed: int = 0
    size: float = 0.0
    """By default as `sizes` has it."""
    at: float = 0.4
    """Share of the joints that come before that of the fault."""
    unusual: dict[str, float] = field(default_factory=dict)

    @cached_property
    def lab(self) -> Lab:
        return Lab(self.robot, self.seed, **{name: x for name, x in self.unusual.items() if name in ("time", "speed")})

    @cached_property
    def faults(self) -> tuple[Fault, ...]:
        lab, n = self.lab, self.lab.robot.n
        j = min(int(self.at * n), n - 1)
        size = self.size or sizes(lab.true, lab.tau, float(lab.robot.model.body_mass[-1]), j, lab.time).get(self.kind, 0.0)
        joint = "" if FAULTS[self.kind].whole else lab.robot.joints[j]
        return (Fault(self.kind, size, joint, *WHEN.get(self.kind, (0.0, None))),)

    def log(self, *faults: Fault) -> MotionLog:
        further = {name: x for name, x in self.unusual.items() if name in ("bits", "colour")}
        return Lab(self.robot, self.seed, self.lab.time, self.lab.speed).log(self.noise, *faults, **further)

    def problem(self) -> Problem:
        """The log as a problem of the robot."""
        return self._problem(*(self.faults if self.kind else ()))

    def _problem(self, *faults: Fault) -> Problem:
        return Problem((self.log(*faults),), self.lab.basis, MODELS.create("explicit"), idbench_chain())

    def found(self) -> tuple[Suspect, ...]:
        """What is wrong."""
        problem = self.problem()
        X = estimate(problem, ESTIMATORS.create("GLS")).X
        silent = silent_joint(problem, X)
        return (silent,) if silent else diagnosed(problem, X)

    def shown(self) -> float:
        """How much less of the torques is explained than without the fault: sum of n log(share / share), n rows."""
        return less_explained(self._problem(), self.problem())

    def motion(self) -> tuple[Basis, Array, State, Array]:
        """The robot, an estimate, some instants of the motion, and their times."""
        problem = self.problem()
        state, every = problem.signals[0].state, 5
        q, qd, qdd = (np.ascontiguousarray(x[:, ::every]) for x in (state.q, state.qd, state.qdd))
        return problem.basis, problem.start.X, State(q, qd, lambda _: qdd), np.arange(q.shape[1]) * every / FS

    def right(self) -> bool:
        """True if the right cause is named first or as its rival, of the right joint; or none where there is none."""
        found = self.found()
        if not found or not self.kind:
            return not found and not self.kind
        return is_named(found[0], self.lab.robot.joints, self.faults)


def less_explained(clean: Problem, faulty: Problem) -> float:
    """What a fault takes of minus twice the logarithm of the likelihood: sum of n ln(share / share) of residuals, n rows."""
    each = (p.explicit.factors for p in (clean, faulty))
    before, after = (np.log(f.squares(f.fit(2).X) / np.maximum(np.sum(f.R[..., -1] ** 2, axis=-1), TINY)) for f in each)
    return float(np.sum(clean.explicit.factors.rows * (after - before)))
