"""The compiled SCARA against the paper's parameters and the textbook's closed form."""

import mujoco
import numpy as np
import pytest

from idbench import models
from idbench.sim.errors import RobotError
from idbench.sim.robot.inverse_dynamics import inverse_dynamics
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.scara import scara_truth


def mass_matrix(X, q2):
    ZZR1, _, _, ZZ2, LMX2, LMY2, _, _ = X
    coupled = LMX2 * np.cos(q2) - LMY2 * np.sin(q2)
    return np.array([[ZZR1 + ZZ2 + 2 * coupled, ZZ2 + coupled], [ZZ2 + coupled, ZZ2]])


def textbook_torque(X, q, qd, qdd):
    """M(q) qdd + Coriolis and centrifugal torques by Christoffel symbols + viscous friction, for one state."""
    _, Fv1, _, _, LMX2, LMY2, Fv2, _ = X
    slope = -LMX2 * np.sin(q[1]) - LMY2 * np.cos(q[1])  # d coupled / d q2
    coriolis = np.array([slope * (2 * qd[0] * qd[1] + qd[1] ** 2), -slope * qd[0] ** 2])
    return mass_matrix(X, q[1]) @ qdd + coriolis + np.array([Fv1, Fv2]) * qd


def test_parameters_are_the_papers(robot, truth):
    computed = scara_truth(robot)
    assert list(computed) == ["ZZR1", "Fv1", "Fs1", "ZZ2", "LMX2", "LMY2", "Fv2", "Fs2"]
    np.testing.assert_allclose(list(computed.values()), truth, rtol=0, atol=1e-12)


def test_mass_matrix_is_the_textbooks(robot, truth, rng):
    data = mujoco.MjData(robot.model)
    for q in rng.uniform(-np.pi, np.pi, (50, 2)):
        data.qpos[:] = q
        mujoco.mj_forward(robot.model, data)
        M = np.zeros((2, 2))
        mujoco.mj_fullM(robot.model, data, M)
        np.testing.assert_allclose(M, mass_matrix(truth, q[1]), atol=1e-12)


def test_inverse_dynamics_is_the_textbooks(robot, truth, rng):
    q, qd, qdd = rng.uniform(-3, 3, (3, 200, 2)) * np.array([1, 2, 10])[:, None, None]
    expected = [textbook_torque(truth, *state) for state in zip(q, qd, qdd, strict=True)]
    np.testing.assert_allclose(inverse_dynamics(robot, q, qd, qdd), expected, atol=1e-12)


def test_everything_is_named(robot):
    model = robot.model
    for kind, count in (
        ("body", model.nbody),
        ("joint", model.njnt),
        ("geom", model.ngeom),
        ("actuator", model.nu),
        ("sensor", model.nsensor),
    ):
        assert all(getattr(model, kind)(i).name for i in range(count)), kind


def test_welded_bodies_count_as_part_of_their_link():
    """A load bolted to link 2 as a body of its own changes the truth as if it were part of the link."""
    spec = mujoco.MjSpec.from_file(str(models.path("scara")))
    load = spec.body("link2").add_body(name="load", pos=[0.3, 0, 0])
    load.mass, load.inertia, load.ipos, load.explicitinertial = 1.5, [0.01, 0.01, 0.01], [0, 0, 0], True
    loaded = scara_truth(Robot("loaded", spec.compile()))
    empty = scara_truth(Robot.load("scara"))
    gained = {name: loaded[name] - empty[name] for name in loaded}
    expected = {"ZZR1": 1.5 * 0.5**2, "ZZ2": 0.01 + 1.5 * 0.3**2, "LMX2": 0.5 * 1.5 * 0.3}
    np.testing.assert_allclose([gained[name] for name in gained], [expected.get(name, 0.0) for name in gained], atol=1e-12)


def test_armature_on_joint_2_is_refused(robot):
    spec = mujoco.MjSpec.from_file(str(models.path("scara")))
    spec.joint("joint2").armature = 0.01
    with pytest.raises(RobotError, match=r"armature 0\.01 on joint 2"):
        scara_truth(Robot("geared", spec.compile()))


@pytest.mark.parametrize(
    "change",
    [
        lambda spec: setattr(spec.joint("joint1"), "stiffness", [4.0, 0, 0]),
        lambda spec: setattr(spec.joint("joint2"), "damping", [0.01, 0.2, 0]),
        lambda spec: setattr(spec.option, "density", 1000.0),
    ],
    ids=["spring", "quadratic damping", "fluid"],
)
def test_what_eight_parameters_do_not_describe_is_refused(change):
    spec = mujoco.MjSpec.from_file(str(models.path("scara")))
    change(spec)
    with pytest.raises(RobotError, match="forces that the eight parameters of a SCARA do not describe"):
        scara_truth(Robot("odd", spec.compile()))


def test_angles_may_be_counted_from_another_pose():
    """The truth is that of q2 as the model counts it; the parameters are checked against its inverse dynamics."""
    spec = mujoco.MjSpec.from_file(str(models.path("scara")))
    spec.joint("joint2").ref = 0.5
    turned = scara_truth(Robot("turned", spec.compile()))
    expected = np.array([[np.cos(0.5), np.sin(0.5)], [-np.sin(0.5), np.cos(0.5)]]) @ [0.12, 0.005]
    np.testing.assert_allclose([turned["LMX2"], turned["LMY2"]], expected, atol=1e-12)


def test_joints_on_one_axis_are_refused():
    spec = mujoco.MjSpec.from_file(str(models.path("scara")))
    spec.body("link2").pos = [0.0, 0.0, 0.1]
    with pytest.raises(RobotError, match="both joints on one axis"):
        scara_truth(Robot("column", spec.compile()))
