"""Logs with one fault each, whose torques MuJoCo's inverse dynamics make."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import mujoco
import numpy as np
import scipy.signal

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
from idbench.identify.data.kinematics import KinematicTree
from idbench.identify.judge.diagnosis import diagnosed, silent_joint
from idbench.identify.judge.suspect import Suspect
from idbench.identify.signals.signals import State
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.tree import kinematic_tree

FS, TIME, BITS = 100.0, 30.0, 17.0


@dataclass
class Lab:
    """A robot on its motion, before anything is logged."""

    name: str
    seed: int
    noise: float
    gravity: Array
    time: float = TIME
    speed: float = 1.0
    bits: float = BITS
    colour: float = 0.0
    t: Array = field(init=False)
    q: Array = field(init=False)
    qd: Array = field(init=False)
    qdd: Array = field(init=False)
    Fv: Array = field(init=False)
    Fs: Array = field(init=False)

    def __post_init__(self) -> None:
        self.rng = np.random.default_rng([self.seed, 7])
        self.model = Robot.load(self.name).model
        self.n = self.model.nv
        self.t = np.arange(0, self.time, 1 / FS)
        f = 0.1 * self.speed * np.arange(1, 6)[:, None, None]
        a, b = (self.rng.standard_normal((5, self.n, 1)) / np.arange(1, 6)[:, None, None] for _ in range(2))
        w = 2 * np.pi * f
        limits = np.where(self.model.jnt_limited[:, None], self.model.jnt_range, [-2.0, 2.0])
        reach = np.minimum(0.4 * np.ptp(limits, axis=1), 1.0)
        q = np.sum(a * np.sin(w * self.t) + b * np.cos(w * self.t), axis=0)
        size = reach / np.abs(q).max(axis=1)
        middle = np.clip(limits.mean(axis=1), -1.0, 1.0)
        self.q = middle[:, None] + size[:, None] * q
        self.qd = size[:, None] * np.sum(w * (a * np.cos(w * self.t) - b * np.sin(w * self.t)), axis=0)
        self.qdd = size[:, None] * np.sum(-(w**2) * (a * np.sin(w * self.t) + b * np.cos(w * self.t)), axis=0)
        level = np.sqrt(np.mean(self.inertial(self.q, self.qd, self.qdd) ** 2, axis=1))
        self.Fs = 0.15 * level * self.rng.uniform(0.7, 1.3, self.n)
        self.Fv = 0.15 * level * self.rng.uniform(0.7, 1.3, self.n) / np.sqrt(np.mean(self.qd**2, axis=1))

    def inertial(self, q: Array, qd: Array, qdd: Array, gravity: Array | None = None, mass: float = 0.0) -> Array:
        """Return the torques of links and rotors; a `mass` [kg] is held 0.1 m from the centre of mass of the last link."""
        model, data = self.model, mujoco.MjData(self.model)
        keep = model.opt.gravity.copy(), model.dof_damping.copy(), model.dof_frictionloss.copy(), model.body_mass.copy()
        flags = model.opt.disableflags
        model.opt.gravity[:] = self.gravity if gravity is None else gravity
        model.dof_damping[:] = 0
        model.dof_frictionloss[:] = 0
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_LIMIT
        found = np.empty_like(q)
        body = model.jnt_bodyid[-1]
        place = model.body_ipos[body].copy()
        whole = model.body_mass[body] + mass
        model.body_ipos[body] += mass / whole * np.array([0.1, 0.0, 0.0])  # a point mass, without its own share of inertia
        model.body_mass[body] = whole
        for k in range(q.shape[1]):
            data.qpos[:], data.qvel[:], data.qacc[:] = q[:, k], qd[:, k], qdd[:, k]
            mujoco.mj_inverse(model, data)
            found[:, k] = data.qfrc_inverse
        model.body_ipos[body] = place
        model.opt.gravity[:], model.dof_damping[:], model.dof_frictionloss[:], model.body_mass[:] = keep
        model.opt.disableflags = flags
        return found

    def friction(self, qd: Array) -> Array:
        return self.Fv[:, None] * qd + self.Fs[:, None] * np.sign(qd)


@dataclass
class Told:
    """What is logged, and what is believed."""

    q: Array
    tau: Array
    tree: KinematicTree
    fs: float = FS
    delay: float = 0.0


def plain(lab: Lab) -> Told:
    tau = lab.inertial(lab.q, lab.qd, lab.qdd) + lab.friction(lab.qd)
    tree = kinematic_tree(Robot.load(lab.name))
    return Told(lab.q.copy(), tau, replace(tree, joints=tuple(replace(j, armature=True) for j in tree.joints)))


def finished(lab: Lab, told: Told) -> MotionLog:
    """Return the log: counts, and noise of a share of each torque."""
    step = 2 * np.pi / 2**lab.bits
    level = np.sqrt(np.mean(told.tau**2, axis=1, keepdims=True))
    tau = told.tau + lab.noise / 100 * level * lab.rng.standard_normal(told.tau.shape)
    if lab.colour:  # of the first order, correlated over half a second
        a = np.exp(-1 / (FS * 0.5))
        slow = scipy.signal.lfilter([np.sqrt(1 - a**2)], [1, -a], lab.rng.standard_normal(told.tau.shape), axis=1)
        tau = tau + lab.colour / 100 * level * slow
    return MotionLog(told.fs, (np.round(told.q / step) * step).T, tau.T, TorqueChannel("instantaneous", told.delay))


Fault = Callable[[Lab, Told], None]


def joint(lab: Lab, share: float) -> int:
    return min(int(share * lab.n), lab.n - 1)


def _gain(share: float, factor: float) -> Fault:
    def fault(lab: Lab, told: Told) -> None:
        told.tau[joint(lab, share)] *= factor

    return fault


def _zero(share: float, degrees: float) -> Fault:
    def fault(lab: Lab, told: Told) -> None:
        told.q[joint(lab, share)] += np.radians(degrees)

    return fault


def _scale(lab: Lab, told: Told) -> None:
    told.q[joint(lab, 0.4)] *= 1.05


def _late(lab: Lab, told: Told) -> None:
    j = joint(lab, 0.4)
    told.tau[j] = np.interp(lab.t - 0.01, lab.t, told.tau[j])


def _all_late(lab: Lab, told: Told) -> None:
    told.tau[:] = [np.interp(lab.t - 0.01, lab.t, x) for x in told.tau]


def _lag(lab: Lab, told: Told) -> None:
    a = np.exp(-1 / (FS * 0.02))
    told.tau[:] = scipy.signal.lfilter([1 - a], [1, -a], told.tau, axis=1)


def _lag_q(lab: Lab, told: Told) -> None:
    a = np.exp(-1 / (FS * 0.02))
    told.q[:] = scipy.signal.lfilter([1 - a], [1, -a], told.q - told.q[:, :1], axis=1) + told.q[:, :1]


def _with_friction(f: Callable[[Lab, Array, Array], Array]) -> Fault:
    """Return a fault that adds to the friction of all joints: f(lab, qd, load)."""

    def fault(lab: Lab, told: Told) -> None:
        load = told.tau - lab.friction(lab.qd)
        told.tau += f(lab, lab.qd, load)

    return fault


def _stribeck(lab: Lab, qd: Array, load: Array) -> Array:
    v = 0.2 * np.sqrt(np.mean(qd**2, axis=1, keepdims=True))
    return 1.0 * lab.Fs[:, None] * np.exp(-((qd / v) ** 2)) * np.sign(qd)


def _power(lab: Lab, qd: Array, load: Array) -> Array:
    v = np.sqrt(np.mean(qd**2, axis=1, keepdims=True))
    return lab.Fv[:, None] * (v * np.sign(qd) * (np.abs(qd) / v) ** 0.5 - qd)


def _asymmetric(lab: Lab, qd: Array, load: Array) -> Array:
    return 0.3 * lab.Fv[:, None] * np.abs(qd) + 0.3 * lab.Fs[:, None]


def _load(lab: Lab, qd: Array, load: Array) -> Array:
    return 0.15 * np.abs(load) * np.sign(qd)


def _warming(lab: Lab, qd: Array, load: Array) -> Array:
    return -0.5 * (lab.t / lab.time) * lab.friction(qd)


def _dahl(lab: Lab, told: Told) -> None:
    for j in range(lab.n):
        z, width = 0.0, 0.03 * np.std(lab.q[j])
        for k in range(1, lab.q.shape[1]):
            dq = lab.q[j, k] - lab.q[j, k - 1]
            z = np.sign(dq) + (z - np.sign(dq)) * np.exp(-abs(dq) / width)
            told.tau[j, k] += lab.Fs[j] * (z - np.sign(lab.qd[j, k]))


def _drift(lab: Lab, told: Told) -> None:
    j = joint(lab, 0.4)
    told.tau[j] += lab.Fs[j] * lab.t / lab.time


def _offset(lab: Lab, told: Told) -> None:
    told.tau[joint(lab, 0.4)] += 0.5 * lab.Fs[joint(lab, 0.4)]


def _cogging(lab: Lab, told: Told) -> None:
    j = joint(lab, 0.4)
    told.tau[j] += 0.5 * lab.Fs[j] * np.sin(8 * lab.q[j])


def _saturated(share: float, of: slice) -> Fault:
    def fault(lab: Lab, told: Told) -> None:
        some = told.tau[of]
        most = share * np.abs(some).max(axis=1, keepdims=True)
        told.tau[of] = np.clip(some, -most, most)

    return fault


def _saturating_motor(lab: Lab, told: Told) -> None:
    top = np.abs(told.tau).max(axis=1, keepdims=True)
    told.tau /= 1 - 0.3 * (told.tau / top) ** 2  # what currents say that the torque constant no longer gives


def _spring(lab: Lab, told: Told) -> None:
    j = joint(lab, 0.4)
    told.tau[j] += 0.5 * np.sqrt(np.mean(told.tau[j] ** 2)) * lab.q[j] / np.std(lab.q[j])


def _tilt(lab: Lab, told: Told) -> None:
    lab.gravity = lab.gravity + 9.81 * np.array([np.sin(np.radians(3)), 0, 1 - np.cos(np.radians(3))])
    told.tau[:] = lab.inertial(lab.q, lab.qd, lab.qdd) + lab.friction(lab.qd)


def _gravity(vector: tuple[float, float, float]) -> Fault:
    def fault(lab: Lab, told: Told) -> None:
        told.tau[:] = lab.inertial(lab.q, lab.qd, lab.qdd, np.array(vector)) + lab.friction(lab.qd)

    return fault


def _base(lab: Lab, told: Told) -> None:
    held = [lab.inertial(lab.q, lab.qd, lab.qdd, lab.gravity + np.array([a, 0, 0])) for a in (1.0, 0.0)]
    told.tau += (held[0] - held[1]) * np.sin(2 * np.pi * 3.0 * lab.t)


def _payload(lab: Lab, told: Told) -> None:
    held = lab.inertial(lab.q, lab.qd, lab.qdd, mass=0.2 * float(lab.model.body_mass.sum()) / lab.n) + lab.friction(lab.qd)
    told.tau[:] = np.where(lab.t > lab.t[-1] / 2, held, told.tau)


def _length(lab: Lab, told: Told) -> None:
    j = max(k for k in range(1, lab.n) if np.linalg.norm(told.tree.joints[k].position) > 0.1)
    x = told.tree.joints[j]
    joints = list(told.tree.joints)
    joints[j] = replace(x, position=x.position * 1.05)
    told.tree = replace(told.tree, joints=tuple(joints))


def _axis(lab: Lab, told: Told) -> None:
    j = joint(lab, 0.5)
    x, a = told.tree.joints[j], np.radians(3)
    turn = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    joints = list(told.tree.joints)
    joints[j] = replace(x, rotation=x.rotation @ turn)
    told.tree = replace(told.tree, joints=tuple(joints))


def _rate(factor: float) -> Fault:
    def fault(lab: Lab, told: Told) -> None:
        told.fs = FS * factor

    return fault


def _slip(lab: Lab, told: Told) -> None:
    told.q[joint(lab, 0.4)] += np.radians(3) * (lab.t > 0.6 * lab.time)


def _collision(lab: Lab, told: Told) -> None:
    j = joint(lab, 0.4)
    told.tau[j] += 3 * np.sqrt(np.mean(told.tau[j] ** 2)) * ((lab.t > 12.0) & (lab.t < 12.3))


def _missing(lab: Lab, told: Told) -> None:
    told.tau[joint(lab, 0.7)] = 0.0


def _exchanged(lab: Lab, told: Told) -> None:
    told.tau[[-2, -1]] = told.tau[[-1, -2]]


def _no_rotor(lab: Lab, told: Told) -> None:
    j = joint(lab, 0.7)
    joints = [replace(x, armature=False) for x in told.tree.joints]
    told.tree = replace(told.tree, joints=tuple(joints))
    told.tau[j] += 0.5 * np.sqrt(np.mean(told.tau[j] ** 2)) * lab.qdd[j] / np.std(lab.qdd[j])


def _coupled(lab: Lab, told: Told) -> None:
    inertia = 0.3 * np.sqrt(np.mean(told.tau[-1] ** 2)) / np.std(lab.qdd[-1])
    told.tau[-1] += inertia * lab.qdd[-2]
    told.tau[-2] += inertia * (lab.qdd[-1] + lab.qdd[-2])


def _elastic(lab: Lab, told: Told) -> None:
    j = joint(lab, 0.4)
    M = max(np.std(told.tau[j]) / np.std(lab.qdd[j]), 1e-6)
    k = M * (2 * np.pi * 5.0) ** 2
    told.q[j] += (told.tau[j] - lab.friction(lab.qd)[j]) / k  # measured at the motor


def _backlash(lab: Lab, told: Told) -> None:
    j = joint(lab, 0.4)
    side = (told.tau[j] - lab.friction(lab.qd)[j]) / np.std(told.tau[j])
    told.q[j] += np.radians(0.5) * np.tanh(10 * side)  # teeth part gently


def _eccentric(lab: Lab, told: Told) -> None:
    j = joint(lab, 0.4)
    told.q[j] += 0.03 * np.sin(told.q[j])


FAULTS: dict[str, tuple[Fault, tuple[str, ...]]] = {
    "none": (lambda lab, told: None, ()),
    "sign_flip": (_gain(0.4, -1.0), ("sign",)),
    "sign_flip_last": (_gain(0.99, -1.0), ("sign",)),
    "gain_one_10pc": (_gain(0.4, 1.1), ("gain",)),
    "gain_last_20pc": (_gain(0.99, 1.2), ("gain",)),
    "gain_first_x2": (_gain(0.0, 2.0), ("gain",)),
    "zero_5deg": (_zero(0.4, 5.0), ("zero",)),
    "zero_1deg": (_zero(0.2, 1.0), ("zero",)),
    "scale_5pc": (_scale, ("scale",)),
    "delay_10ms_one": (_late, ("delay", "lag")),
    "delay_10ms_all": (_all_late, ("delay", "lag")),
    "lagged_tau": (_lag, ("delay", "lag")),
    "lagged_q": (_lag_q, ("delay", "lag")),
    "stribeck": (_with_friction(_stribeck), ("velocity",)),
    "viscous_power": (_with_friction(_power), ("velocity",)),
    "asymmetric": (_with_friction(_asymmetric), ("asymmetry", "offset")),
    "load_friction": (_with_friction(_load), ("load",)),
    "warming": (_with_friction(_warming), ("warming",)),
    "dahl": (_dahl, ("hysteresis",)),
    "drift": (_drift, ("drift",)),
    "offset": (_offset, ("offset",)),
    "cogging": (_cogging, ("cogging",)),
    "saturated_70pc": (_saturated(0.7, slice(None)), ("saturation",)),
    "saturated_40pc_one": (_saturated(0.4, slice(1, 2)), ("saturation",)),
    "saturating_motor": (_saturating_motor, ("saturation",)),
    "spring": (_spring, ("spring",)),
    "tilt_3deg": (_tilt, ("tilt",)),
    "ceiling": (_gravity((0, 0, 9.81)), ("gravity",)),
    "wall": (_gravity((9.81, 0, 0)), ("gravity", "tilt")),
    "no_gravity": (_gravity((0, 0, 0)), ("gravity",)),
    "base_3Hz": (_base, ("base_motion",)),
    "payload_half": (_payload, ("payload",)),
    "length_5pc": (_length, ("length",)),
    "axis_3deg": (_axis, ("axis",)),
    "rate_10pc": (_rate(1.1), ("rate",)),
    "rate_0p8pc": (_rate(0.992), ("rate",)),
    "slip": (_slip, ("slip",)),
    "collision": (_collision, ("collision",)),
    "missing_torque": (_missing, ("missing_torque",)),
    "exchanged": (_exchanged, ("exchanged",)),
    "no_rotor": (_no_rotor, ("rotor",)),
    "coupled": (_coupled, ("coupled_rotor",)),
    "elastic_5Hz": (_elastic, ("elasticity",)),
    "backlash": (_backlash, ("backlash",)),
    "eccentric": (_eccentric, ("eccentric",)),
}
"""Faults, and the causes that are right."""


NULLS: dict[str, dict[str, float]] = {
    "plain": {},
    "12 bits": {"bits": 12.0},
    "coloured 2 %": {"colour": 2.0},
    "slow": {"speed": 0.2},
    "short": {"time": 10.0},
}
"""Logs without a fault: what is unusual about them."""


@dataclass
class Case:
    """One log."""

    robot: str
    noise: float
    name: str
    seed: int
    fault: Fault
    causes: tuple[str, ...]
    unusual: dict[str, float] = field(default_factory=dict)

    def log(self) -> tuple[MotionLog, KinematicTree]:
        """Return the log, and what is believed of the robot."""
        lab = Lab(self.robot, self.seed, self.noise, np.array([0, 0, -9.81]), **self.unusual)
        told = plain(lab)
        self.fault(lab, told)
        return finished(lab, told), told.tree

    def problem(self) -> Problem:
        """Return the log as a problem of the robot."""
        log, tree = self.log()
        return Problem((log,), BaseParameters.of(tree, tree_basis(tree)).basis, MODELS.create("explicit"), idbench_chain())

    def found(self) -> tuple[Suspect, ...]:
        """Return what is wrong."""
        problem = self.problem()
        X = estimate(problem, ESTIMATORS.create("GLS")).X
        silent = silent_joint(problem, X)
        return (silent,) if silent else diagnosed(problem, X)

    def shown(self) -> float:
        """Return how much less of the torques is explained than without the fault: sum of n log(share / share), n rows."""
        clean = replace(self, fault=FAULTS["none"][0]).problem().factors
        faulty = self.problem().factors
        each = [np.log(f.squares(f.fit(2).X) / np.maximum(np.sum(f.R[..., -1] ** 2, axis=-1), TINY)) for f in (faulty, clean)]
        return float(np.sum(clean.rows * (each[0] - each[1])))

    def motion(self) -> tuple[Basis, Array, State, Array]:
        """Return the robot, an estimate, some instants of the motion, and their times."""
        problem = self.problem()
        state, every = problem.signals[0].state, 5
        q, qd, qdd = (np.ascontiguousarray(x[:, ::every]) for x in (state.q, state.qd, state.qdd))
        return problem.basis, problem.start.X, State(q, qd, lambda _: qdd), np.arange(q.shape[1]) * every / FS

    def right(self) -> bool:
        """Return whether the right cause is named first, or none where there is none."""
        found = self.found()
        return found[0].cause in self.causes if found else not self.causes
