"""Drives that turn with several joints, and springs, against MuJoCo's own torques."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from builders import defects

from idbench.identify import ExplicitModel, OfJoints, tree_basis
from idbench.identify.arrays import combined
from idbench.identify.basis import CoulombFriction, ViscousFriction
from idbench.identify.signals.signals import State
from idbench.sim.robot.mounting import Mounting, coupled
from idbench.sim.robot.rewrite import compiled, rewritten
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.tree import kinematic_tree, standard_parameters

WRIST = """<mujoco><compiler angle="radian"/><worldbody>
<body name="a"><joint name="bend" axis="0 1 0" stiffness="3" springref="0.2" armature="0.1" damping="0.4"/>
<inertial pos="0.1 0 0.2" mass="2" diaginertia="0.1 0.1 0.1"/>
<body name="b" pos="0.3 0 0"><joint name="turn" axis="1 0 0" armature="0.05"/>
<inertial pos="0 0.05 0" mass="1" diaginertia="0.02 0.02 0.02"/></body></body></worldbody>
<tendon><fixed name="motor" armature="0.3" damping="0.7" frictionloss="0.9" stiffness="1.5" springlength="0.4">
<joint joint="bend" coef="1"/><joint joint="turn" coef="-0.5"/></fixed></tendon></mujoco>"""


@pytest.fixture
def wrist(written):
    return written(WRIST)


def torques(robot, q, qd, qdd):
    """Return what MuJoCo needs for a motion, with Coulomb friction of the tendon, which is no force of its inverse dynamics."""
    data, found = mujoco.MjData(robot.model), []
    for at in zip(q.T, qd.T, qdd.T, strict=True):
        data.qpos, data.qvel, data.qacc = at
        mujoco.mj_inverse(robot.model, data)
        J = np.array([1.0, -0.5])
        # mj_inverse takes the constraint's friction for given accelerations; that of sliding is its sign.
        inverse = data.qfrc_inverse + data.qfrc_constraint
        found.append(inverse + J * 0.9 * np.sign(J @ at[1]))
    return np.array(found).T


def test_columns_times_truth_are_mujocos_torques(wrist, rng):
    robot = Robot.load(wrist)
    tree, truth = kinematic_tree(robot), standard_parameters(robot)
    assert tree.couplings[0].weights == (1.0, -0.5)
    basis = tree_basis(tree)
    X = np.array([truth.get(name, 0.0) for name in basis.names])
    q, qd, qdd = rng.uniform(-1, 1, (3, 2, 40))
    found = combined(basis.explicit(State(q, qd, lambda _: qdd)), X, np.zeros((2, 40)))
    np.testing.assert_allclose(found, torques(robot, q, qd, qdd), atol=1e-10)


def test_a_coupling_keeps_the_identities_of_a_block(wrist, rng):
    """Of all columns, those of links and joints among them."""
    basis = tree_basis(kinematic_tree(Robot.load(wrist)))
    own = [name for name in basis.names if name.endswith("_motor") or name.startswith("K")]
    assert {"Ia_motor", "Fv_motor", "Fs_motor", "Fsx_motor", "K_motor", "K1"} == set(own)
    assert max(defects(basis, basis.names, *rng.uniform(-1, 1, (3, 2, 20)))) < 1e-12


@pytest.mark.parametrize(("joints", "kept"), [((0, 1, 2), True), ((1, 2), True), ((0, 1), False)])
def test_a_coupled_motor_has_the_friction_that_all_its_joints_have(wrist, joints, kept):
    """Also where a further joint, with which it does not turn, has another."""
    tree = kinematic_tree(Robot.load(wrist))
    (coupling,) = tree.couplings
    first = replace(tree.joints[0], name="base", parent=-1)
    rest = [replace(joint, parent=joint.parent + 1) for joint in tree.joints]
    longer = replace(tree, joints=(first, *rest), couplings=(replace(coupling, weights=(0.0, *coupling.weights)),))
    names = tree_basis(longer, (ViscousFriction(), OfJoints(CoulombFriction(), joints))).names
    found = {name for name in names if "motor" in name} - {"Ia_motor", "K_motor"}
    assert found == {"Fv_motor"} | ({"Fs_motor", "Fsx_motor"} if kept else set())


def test_a_file_with_couplings_and_springs_comes_back(wrist):
    robot = Robot.load(wrist)
    values = {**standard_parameters(robot), "Ia_motor": 0.25, "Fv_motor": 0.5, "Fs_motor": 0.4, "K_motor": 2.0, "K1": 5.0}
    again = standard_parameters(compiled(wrist, rewritten(wrist, values)))
    assert {name: again[name] for name in values} == pytest.approx(values)


def test_an_option_adds_a_coupling():
    mounting = Mounting(couplings=coupled(["m=joint5-0.5*joint6"]))
    robot = Robot.load("puma560", mounting.edit)
    (coupling,) = kinematic_tree(robot, ["m"]).couplings
    assert coupling.weights == (0, 0, 0, 0, 1.0, -0.5)
    assert coupling.armature
    assert kinematic_tree(robot).couplings == ()  # it has nothing of its own in the file
    values = {**standard_parameters(robot), "Ia_m": 0.02, "Fs_m": 0.3}
    again = standard_parameters(compiled("puma560", rewritten("puma560", values, mounting=mounting)))
    assert (again["Ia_m"], again["Fs_m"]) == pytest.approx((0.02, 0.3))


def test_a_wrist_is_identified_with_its_coupling(wrist):
    """On noise-free data, to the differences' own error; without the coupling it is far off."""
    from idbench.experiments.identification.robot_model import RobotModel
    from idbench.identify import identify
    from idbench.sim.engine.simulation import simulate
    from idbench.sim.scenario.scenario_file import from_dict

    trajectory = {"kind": "random", "moves": 12, "durations": [1.0, 1.4], "rest": 1.0}
    run = simulate(from_dict({"name": "wrist", "robot": wrist, "trajectory": trajectory, "fs": 200.0}))
    robot_model = RobotModel(wrist)
    truth = robot_model.truth(run.robots[0])
    found = identify(run.alone(), robot_model.basis, ExplicitModel())
    for name in ("Ia_motor", "Fv_motor", "Fs_motor", "K_motor", "K1"):
        assert found.X[found.names.index(name)] == pytest.approx(truth[name], rel=2e-3), name
