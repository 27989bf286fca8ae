"""Faults of a scenario: what each makes of a log, and that the doctor names it, with its joint."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

import idbench
from idbench.experiments.identification.wordings import WORDINGS
from idbench.identify import MotionLog, TorqueChannel
from idbench.sim.engine.simulation import simulate
from idbench.sim.errors import ScenarioError
from idbench.sim.robot.robot import Robot
from idbench.sim.scenario.faults import FAULTS, Fault, with_faults
from idbench.sim.scenario.scenario_file import from_dict, load, to_toml
from idbench.sim.settings import read_toml

ROBOT = Robot.load("puma560")
T = np.arange(400) / 100


@pytest.fixture(scope="module")
def true():
    """A motion with its derivatives in closed form, shape (time, joint) each."""
    w, phase = 1 + 0.3 * np.arange(ROBOT.n), np.arange(ROBOT.n)
    angle = np.outer(T, w) + phase
    return 0.4 * np.sin(angle), 0.4 * w * np.cos(angle), -0.4 * w**2 * np.sin(angle)


def torques(model, q, qd, qdd):
    """MuJoCo's mj_inverse, state by state, without friction and the limits of joints."""
    data, found = mujoco.MjData(model), np.zeros_like(q)
    model.dof_damping[:] = model.dof_frictionloss[:] = 0
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_LIMIT
    for k in range(len(q)):
        data.qpos[:], data.qvel[:], data.qacc[:] = q[k], qd[k], qdd[k]
        mujoco.mj_inverse(model, data)
        found[k] = data.qfrc_inverse
    return found


@pytest.fixture(scope="module")
def made(true):
    """Returns the log of a robot with some faults, and without."""
    log = MotionLog(100.0, true[0], torques(Robot.load("puma560").model, *true), TorqueChannel("instantaneous"))
    return lambda *faults: (with_faults(ROBOT, log, true, faults, np.random.default_rng(0)), log)


@pytest.mark.parametrize(
    ("kind", "size", "q", "tau"),
    [
        ("gain", 0.2, lambda q, tau: q, lambda q, tau: 1.2 * tau),
        ("sign", 0.0, lambda q, tau: q, lambda q, tau: -tau),
        ("axis-sign", 0.0, lambda q, tau: -q, lambda q, tau: -tau),
        ("offset", 2.0, lambda q, tau: q, lambda q, tau: tau + 2),
        ("drift", 0.5, lambda q, tau: q, lambda q, tau: tau + 0.5 * T),
        ("delay", 0.02, lambda q, tau: q, lambda q, tau: np.concatenate([tau[[0, 0]], tau[:-2]])),
        ("position-delay", 0.02, lambda q, tau: np.concatenate([q[[0, 0]], q[:-2]]), lambda q, tau: tau),
        ("zero", 0.1, lambda q, tau: q + 0.1, lambda q, tau: tau),
        ("scale", 0.1, lambda q, tau: 1.1 * q, lambda q, tau: tau),
        ("degrees", 0.0, lambda q, tau: 180 * q / np.pi, lambda q, tau: tau),
        ("spring", 3.0, lambda q, tau: q, lambda q, tau: tau + 3 * q),
        ("cogging", 0.3, lambda q, tau: q, lambda q, tau: tau + 0.3 * np.sin(12 * q)),
        ("saturation", 0.5, lambda q, tau: q, lambda q, tau: np.clip(tau, -np.abs(tau).max() / 2, np.abs(tau).max() / 2)),
    ],
)
def test_faults_of_a_joint_are_what_they_say(made, kind, size, q, tau):
    found, log = made(Fault(kind, size, "joint3"))
    np.testing.assert_allclose(found.q[:, 2], q(log.q[:, 2], log.tau[:, 2]), atol=1e-12)
    np.testing.assert_allclose(found.tau[:, 2], tau(log.q[:, 2], log.tau[:, 2]), atol=1e-9)
    others = [j for j in range(ROBOT.n) if j != 2]
    np.testing.assert_array_equal(found.q[:, others], log.q[:, others])
    np.testing.assert_array_equal(found.tau[:, others], log.tau[:, others])


@pytest.mark.parametrize("kind", ["tilt", "length", "payload", "compensated"])
def test_another_robot_has_the_torques_of_mujocos_inverse_dynamics(made, true, kind):
    found, _ = made(Fault(kind, 0.2, "joint3" if kind == "length" else ""))
    model = Robot.load("puma560").model
    if kind == "tilt":
        g = np.array([0, 0, -9.81])
        tilted = [inverse for axis in np.eye(3)[:2] for inverse in (axis, -axis)]
        every = []
        for axis in tilted:
            model.opt.gravity[:] = np.cos(0.2) * g + np.sin(0.2) * np.cross(axis, g)
            every.append(np.abs(found.tau - torques(model, *true)).max())
        assert min(every) < 1e-6
        return
    if kind == "length":
        body = model.jnt_bodyid[2]
        model.body_pos[body] *= 1 + 0.2 / np.linalg.norm(model.body_pos[body])
    elif kind == "compensated":
        model.opt.gravity[:] = 0
    else:  # a sphere whose inertia about the new centre of mass is that of the parallel axes
        body, more = model.jnt_bodyid[-1], np.array([0.1, 0, 0])
        m, place = model.body_mass[body], np.array(model.body_ipos[body])
        model.body_inertia[body] += 0.2 * m / (m + 0.2) * np.sum((more - place) ** 2)
        model.body_ipos[body] = (m * place + 0.2 * more) / (m + 0.2)
        model.body_mass[body] = m + 0.2
    np.testing.assert_allclose(found.tau, torques(model, *true), atol=1e-6)


def test_faults_have_a_beginning_and_an_end_and_follow_each_other(made):
    found, log = made(Fault("offset", 1.0, "joint1", start=1.0, end=2.0), Fault("gain", 1.0, "joint1"))
    inside = (log.t >= 1.0) & (log.t <= 2.0)
    np.testing.assert_allclose(found.tau[:, 0], 2 * (log.tau[:, 0] + inside), rtol=1e-12)


def test_each_fault_has_a_cause_that_the_doctor_knows():
    assert {kind.cause for kind in FAULTS.values()} <= set(WORDINGS)


def test_scenarios_with_faults_are_written_and_read(tmp_path):
    faults = [{"kind": "gain", "size": 0.15, "joint": "joint1"}, {"kind": "payload", "size": 0.5, "start": 3.0}]
    scenario = from_dict({"name": "two", "trajectory": "brisk", "fault": faults})
    (tmp_path / "two.toml").write_text(to_toml(scenario))
    assert from_dict(read_toml(tmp_path / "two.toml", "scenario")) == scenario
    assert scenario.imperfections == ["fault"]


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ({"kind": "gian"}, r"kind = 'gian' is unknown \(did you mean 'gain'\?\)"),
        ({"kind": "gain", "joint": "elbow", "size": 0.1}, "joint = 'elbow'; joints are joint1, joint2"),
        ({"kind": "payload", "joint": "joint1", "size": 1.0}, "leave joint out"),
        ({"kind": "gain"}, r"size = 0 \[1\] of a fault 'gain' must be a number other than 0"),
        ({"kind": "rate", "size": -1.0}, "between -0.9 and 9"),
        ({"kind": "rate", "size": 0.1, "start": 2.0}, "start and end have no effect"),
        ({"kind": "push", "size": 1.0, "start": 2.0, "end": 1.0}, "end = 1 s must be after start = 2 s"),
        ({"kind": "exchanged"}, "joint is missing"),
        ({"kind": "exchanged", "joint": "joint2"}, "there is no joint after 'joint2'"),
    ],
)
def test_faults_that_make_no_sense_are_refused(fault, message):
    with pytest.raises(ScenarioError, match=message):
        simulate(replace(from_dict({"name": "one", "trajectory": "brisk", "fault": [fault]})))


def test_severity_makes_faults_larger_and_is_refused_where_none_has_a_size():
    content = {"name": "one", "trajectory": "brisk", "severity": 0.5}
    for kind, size, half in (("gain", 0.2, 0.1), ("saturation", 0.6, 0.8)):  # what is cut off is a half
        assert from_dict({**content, "fault": [{"kind": kind, "size": size}]}).faults[0].size == pytest.approx(half)
    with pytest.raises(ScenarioError, match=r"severity = 0\.5 has no effect"):
        from_dict({**content, "fault": [{"kind": "sign"}]})


def test_joints_at_rest_and_without_a_torque_take_every_fault():
    still = np.zeros((400, ROBOT.n))
    log = MotionLog(100.0, still, still, TorqueChannel("instantaneous"))
    for kind, flaw in FAULTS.items():
        fault = Fault(kind, 0.05, "" if flaw.whole else "joint3")
        found = with_faults(ROBOT, log, (still, still, still), (fault,), np.random.default_rng(0))
        assert np.isfinite(found.q).all()
        assert np.isfinite(found.tau).all()


SIZES = {
    "gain": 0.2, "sign": 0.0, "position-sign": 0.0, "axis-sign": 0.0, "offset": 1.0, "drift": 0.1, "falling-constant": 0.3,
    "delay": 0.01, "position-delay": 0.03, "scale": 0.05, "eccentric": 0.03, "degrees": 0.0, "load-friction": 0.15,
    "stribeck": 1.0, "asymmetry": 0.3, "warming": 0.5, "hysteresis": 1.0, "cogging": 1.0, "commutation": 0.1,
    "backlash": 0.01, "unlogged": 3.0, "exchanged-torques": 0.0, "exchanged-positions": 0.0, "exchanged": 0.0,
}  # fmt: skip
"""Faults that the log of a planar arm shows; a zero of its second joint, for one, turns the frame of a link alone."""

FAST = ("gain", "cogging", "delay", "degrees")


@pytest.mark.parametrize("kind", [pytest.param(kind, marks=() if kind in FAST else pytest.mark.thorough) for kind in SIZES])
def test_the_doctor_names_a_fault_and_its_joint(kind):
    joint = "joint1" if "exchanged" in kind else "joint2"
    scenario = replace(load("ideal"), fault=(Fault(kind, SIZES[kind], joint),))
    fit = idbench.fit(simulate(scenario).alone(), "scara", armature="all").fit
    first = fit.diagnosis[0]
    assert (first.suspect.cause, first.suspect.of) == FAULTS[kind].cause
    # Of two joints nobody knows which one's gain, sign of the axis, or column is the wrong one.
    rivals = {first.joint, *(scenario.real_robot.joints[j] for _, j in first.suspect.alternatives if j is not None)}
    assert "joint2" in rivals or kind in ("position-sign", "axis-sign") or "exchanged" in kind
