"""`--friction auto` over many robots: laws found, and unseen torque beside that of standard friction; torques by mj_inverse."""

from dataclasses import replace

import numpy as np
import pytest

from idbench.experiments.identification.fitting import fit
from idbench.experiments.identification.friction_choice import chosen_friction
from idbench.experiments.identification.logs import Logs
from idbench.experiments.identification.method import Method
from idbench.experiments.identification.request import Request
from idbench.experiments.identification.robot_model import RobotModel
from idbench.identify import ExplicitModel, MotionLog, Problem, TorqueChannel, validate
from idbench.identify.signals.masks import NoMask
from idbench.sim.robot.inverse_dynamics import inverse_dynamics

pytestmark = pytest.mark.thorough

FS, STEP = 100.0, 2 * np.pi / 2**17
"""Sampling [Hz] and step of the encoders [rad]."""

OFTEN = 1.0, -1.0
LAWS = {
    "": lambda v, load, a: np.sign(v),
    "offset": lambda v, load, a: np.sign(v) + 0.4 * a.part,
    "asymmetric-viscous": lambda v, load, a: np.sign(v) + 0.4 * a.part * a.viscous * np.abs(v),
    "load": lambda v, load, a: np.sign(v) * (1 + 0.08 * np.abs(load) / a.coulomb),
    "stribeck": lambda v, load, a: np.sign(v) * (1 + 0.8 * abs(a.part) * np.exp(-((v / a.speed) ** 2))),
    "arctan": lambda v, load, a: 2 / np.pi * np.arctan(v / a.speed),
    "tanh": lambda v, load, a: np.tanh(v / a.speed),
}
"""Friction in multiples of the joint's Coulomb friction."""


class Joint:
    """What a joint's friction is made of, drawn at random."""

    def __init__(self, rng, coulomb, viscous, laws):
        self.law = laws[rng.integers(len(laws))]
        self.coulomb = rng.uniform(0.3, 1.5) * coulomb
        self.part = rng.choice(OFTEN) * rng.uniform(0.5, 1.0)
        self.speed = rng.uniform(0.08, 0.4)
        self.viscous = viscous / self.coulomb


def motion(rng, n, duration, speed):
    """Return q, qd and qdd of a Fourier series in which each joint reaches its speed, shape (time, joint)."""
    t, w = np.arange(0, duration, 1 / FS), 0.2 * np.pi * np.array([1, 2, 3, 5, 7])[:, None]
    a, b = rng.standard_normal((2, n, 5, 1))
    q, qd, qdd = (
        np.sum(x, axis=1)
        for x in (
            a * np.sin(w * t) + b * np.cos(w * t),
            w * (a * np.cos(w * t) - b * np.sin(w * t)),
            -(w**2) * (a * np.sin(w * t) + b * np.cos(w * t)),
        )
    )
    factor = (speed / np.abs(qd).max(axis=1))[:, None]
    return (factor * q).T, (factor * qd).T, (factor * qdd).T


def log(robot_model, joints, rng, duration, speed):
    """Return a log with 17 bits and torque noise of 1 %."""
    robot = robot_model.robot
    q, qd, qdd = motion(rng, robot.n, duration, speed * rng.uniform(0.7, 1.3, robot.n))
    rigid = inverse_dynamics(robot, q, qd, qdd) - robot.model.dof_damping * qd
    friction = [a.coulomb * (a.viscous * v + LAWS[a.law](v, load, a)) for a, v, load in zip(joints, qd.T, rigid.T, strict=True)]
    tau = rigid + np.transpose(friction)
    noise = 0.01 * tau.std(axis=0) * rng.standard_normal(tau.shape)
    return MotionLog(FS, np.round(q / STEP) * STEP, tau + noise, TorqueChannel("instantaneous"))


def studied(name, seed, laws, masked):
    """Return laws of a robot's joints, those that were found, and unseen torque over that of standard friction, worst joint."""
    rng, robot_model = np.random.default_rng([seed, 11]), RobotModel(name)
    model = robot_model.robot.model
    coulomb, viscous = (np.where(x > 0, x, least) for x, least in ((model.dof_frictionloss, 1.0), (model.dof_damping, 0.1)))
    joints = [Joint(rng, *own, laws) for own in zip(coulomb, viscous, strict=True)]
    fitted, unseen = (
        log(robot_model, joints, np.random.default_rng([seed, k]), *own) for k, own in ((1, (40, 1.5)), (2, (20, 2.0)))
    )
    request = Request(robot_model, models=("explicit",), method=Method.named(estimator="WLS"))
    if not masked:
        request = request.with_chain(replace(request.method.chain, mask=NoMask()))
    auto, _ = chosen_friction(request, (fitted,))
    rms = []
    for each in (request, auto):
        found = fit(each, Logs((fitted,)))
        problem = Problem((unseen,), found.basis, ExplicitModel(), found.processing)
        rms.append(np.asarray(validate(problem, found.estimates["explicit"].X).rms))
    return [a.law for a in joints], auto.robot_model.laws.names, float((rms[1] / rms[0]).max())


def expected(law, mask):
    """Return the laws that a choice should end with; behind a mask Coulomb friction stays."""
    smooth = not mask and law in ("arctan", "tanh")
    return {"viscous", law} if smooth else {"viscous", "coulomb", law} - {""}


@pytest.mark.parametrize(
    ("name", "robots", "mask", "least"),
    [("scara", 20, True, 32), ("puma560", 10, True, 56), ("scara", 10, False, 15)],
)
def test_laws_are_found_and_unseen_torque_is_never_worse(name, robots, mask, least):
    """Nine in ten laws of the SCARA and all but a few of the PUMA's are found; the others predict as well."""
    laws = [law for law in LAWS if law != "tanh" or not mask]
    true, found, worst = zip(*(studied(name, seed, laws, mask) for seed in range(500, 500 + robots)), strict=True)
    pairs = [pair for each, names in zip(true, found, strict=True) for pair in zip(each, names, strict=True)]
    assert sum(set(names) == expected(law, mask) for law, names in pairs) >= least
    assert max(worst) < 1.05
