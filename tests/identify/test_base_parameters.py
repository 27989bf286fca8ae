"""Base parameters against published counts, the closed form, and their own definition."""

import re
from dataclasses import dataclass, replace
from importlib.metadata import files

import numpy as np
import pytest
from builders import SOLVED, arm, at, matrix

import idbench.identify.parameters.base_parameters
from idbench.identify import (
    MODELS,
    AbstractConservativeBlock,
    Armature,
    BaseParameters,
    Basis,
    CoulombFriction,
    Joint,
    KinematicTree,
    Offset,
    OfJoints,
    Parameter,
    Problem,
    SettingError,
    TreeLinks,
    ViscousFriction,
    idbench_chain,
    identify_each,
    scara,
    tree_basis,
)
from idbench.identify.data.motion_log import MotionLog, TorqueChannel
from idbench.sim.engine.run import ideal_log
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.tree import kinematic_tree
from idbench.sim.trajectories import RandomMoves


def inertial(tree):
    """Return the grouping of the links alone, no rotors, no friction."""
    return BaseParameters.of(tree, Basis(tree.n, (TreeLinks(tree),)))


def columns(basis, q, qd, qdd):
    return matrix(basis.explicit(at(q, qd, qdd)), basis.n, basis.names, q.shape[-1]).reshape(-1, len(basis.names))


def planar(count, gravity):
    """A chain of hinges about parallel z axes, a metre apart."""
    joints = [Joint(f"j{k}", "hinge", k - 1, [float(k > 0), 0, 0], np.eye(3), [0, 0, 1], [0, 0, 0]) for k in range(count)]
    return KinematicTree("planar", tuple(joints), gravity)


@pytest.mark.parametrize(("robot", "hinges", "parallel"), [("puma560", 6, 1), ("panda", 7, 1), ("scara", 2, 2)], ids=str)
def test_counts_are_those_that_were_published(robot, hinges, parallel):
    """7 n - 4 b - 2 inertial parameters, for hinges that follow each other parallel or at right angles on a first axis along
    gravity, b of them always parallel to it: H. Mayeda, K. Yoshida and K. Osuka, "Base parameters of manipulator dynamic
    models", IEEE Trans. Robotics and Automation 6 (1990) 312-321; theirs for the PUMA 560 is 36, 43 for 7 joints.
    """
    assert len(inertial(kinematic_tree(Robot.load(robot))).names) == 7 * hinges - 4 * parallel - 2


@pytest.mark.parametrize("count", [1, 2, 3])
def test_counts_of_planar_arms_with_and_without_gravity(count):
    """The same source: 7 n - 4 b where the first axis is not along gravity, here b = n."""
    assert len(inertial(planar(count, [0, 0, -9.81])).names) == 3 * count - 2
    assert len(inertial(planar(count, [0, -9.81, 0])).names) == 3 * count


def test_counts_of_other_peoples_arms(peer):
    """UR5: 36 by the formula above; and the rank of the columns at other states, by singular values, of either."""
    found = inertial(peer.tree)
    q, qd, qdd = np.random.default_rng(1).uniform(-2, 2, (3, peer.tree.n, 400))
    rank = np.linalg.matrix_rank(columns(found.standard, q, qd, qdd), tol=1e-6 * q.shape[-1])
    assert len(found.names) == rank
    assert peer.tree.n != 6 or rank == 36


@pytest.mark.parametrize("robot", ["scara", "puma560", "panda"])
def test_base_parameters_make_the_same_torques(robot, rng):
    _, tree, found, X = arm(robot)
    states = rng.uniform(-3, 3, (3, tree.n, 50))
    X = rng.normal(size=len(X))
    torques = columns(found.standard, *states) @ X
    np.testing.assert_allclose(columns(found.basis, *states) @ found.base(X), torques, atol=1e-10 * np.abs(torques).max())


def test_names_show_the_grouping():
    found = arm("scara").grouping
    assert found.names == ("ZZR1", "Fv1", "Fs1", "ZZ2", "MX2", "MY2", "Fv2", "Fs2")
    assert found.grouping(0) == "ZZ1 + Ia1 + 0.25 M2"
    assert found.grouping(4) == "MX2"
    assert "M1" in found.without_effect
    assert "ZZ1" not in found.without_effect


def test_the_offset_of_a_vertical_slide_is_grouped_with_its_weight():
    """(M + Ia) qdd + M g + off: a mass more and a rotor less is a constant force."""
    slide = Joint("lift", "slide", -1, [0, 0, 0], np.eye(3), [0, 0, 1], [0, 0, 0])
    tree = KinematicTree("lift", (slide,), [0, 0, -9.81])
    found = BaseParameters.of(tree, tree_basis(tree) + Offset())
    assert found.names == ("MR1", "IaR1", "Fv1", "Fs1")
    assert found.basis.units == ("kg", "kg", "N s/m", "N")
    assert found.grouping(0) == f"M1 + {1 / 9.81:.6g} off1"
    assert found.grouping(1) == f"Ia1 - {1 / 9.81:.6g} off1"


def test_the_scaras_tree_spans_its_closed_form_and_gives_the_same_estimates(log, rng):
    tree = kinematic_tree(Robot.load("scara"))
    standard = Basis(2, (TreeLinks(tree), OfJoints(Armature(), (0,)), ViscousFriction(), CoulombFriction()))
    found = BaseParameters.of(tree, standard)
    states = rng.uniform(-3, 3, (3, 2, 200))
    mine, closed = columns(found.basis, *states), columns(scara(), *states)
    T = np.linalg.lstsq(mine, closed, rcond=None)[0]
    np.testing.assert_allclose(mine @ T, closed, atol=1e-12)
    assert np.linalg.cond(T) < 10
    models = {name: MODELS.create(name) for name in SOLVED}
    by_tree, by_form = identify_each(log, found.basis, models), identify_each(log, scara(), models)
    for name, estimate in by_form.items():
        np.testing.assert_allclose(T @ estimate.X, by_tree[name].X, rtol=1e-9)
        np.testing.assert_allclose(by_tree[name].residual_rms, estimate.residual_rms, rtol=1e-4, atol=1e-12)


@pytest.mark.thorough
@pytest.mark.parametrize("robot", ["puma560", "panda"])
def test_ideal_data_give_every_base_parameter_in_all_models(robot):
    """Torques by MuJoCo, sensors exact: the remaining error is that of differences and of what lies between samples."""
    made, _, found, standard = arm(robot)
    moves = RandomMoves(moves=25, durations=(0.9, 1.5), velocity=(2.0,), rest=1.0)
    log, X = ideal_log(made, moves.sample(made, 200.0)), found.base(standard)
    models = {name: MODELS.create(name) for name in SOLVED}
    for name, estimate in identify_each(log, found.basis, models, idbench_chain()).items():
        weight = np.linalg.norm(estimate.rows.W, axis=0) / np.linalg.norm(estimate.rows.Y)
        assert np.abs((estimate.X - X) * weight).max() < 1e-5, name  # shares of the torque that errors make


def test_a_motion_that_hides_parameters_is_told_from_a_robot_that_does(log):
    """Structural: ZZ1 and Ia1 are one parameter on any motion. Of the data: joint 2 stands, and what it moves is not shown."""
    found = arm("scara").grouping
    still = MotionLog(log.fs, log.q * [1, 0], log.tau, TorqueChannel("instantaneous"))
    factor = Problem((still,), found.basis, MODELS.create("power"), idbench_chain()).factors.together
    assert set(factor.not_shown()) >= {"Fv2", "Fs2"}
    assert "Fv1" not in factor.not_shown()
    assert len(found.names) == 8


def test_parameters_can_be_left_out_and_unknown_ones_are_refused():
    basis = arm("panda").grouping.basis
    fewer = basis.without("Fs1", "ZZR1")
    assert set(basis.names) - set(fewer.names) == {"Fs1", "ZZR1"}
    assert len(fewer.units) == len(fewer.names)
    with pytest.raises(SettingError, match="no parameter Fs9"):
        basis.without("Fs9")


def test_the_grouping_does_not_depend_on_the_states_that_were_drawn(monkeypatch):
    one = arm("panda").grouping
    monkeypatch.setattr(idbench.identify.parameters.base_parameters, "SEED", 7)
    two = arm("panda").grouping
    assert one.names == two.names
    np.testing.assert_allclose(one.K, two.K, atol=1e-9)


ARMS = {
    "kinova": "kinova_description/robots/kinova.urdf",
    "xarm7": "xarm_description/urdf/xarm7.urdf",
    "z1": "z1_description/urdf/z1.urdf",
    "so100": "so_arm_description/urdf/so100.urdf",
    "so101": "so_arm_description/urdf/so101.urdf",
    "ur3": "ur_description/urdf/ur3_robot.urdf",
    "talos": "talos_data/robots/talos_left_arm.urdf",
    "hextilt": "hextilt_description/urdf/hextilt_flying_arm_5.urdf",
}
"""Serial arms of other people, as files."""


def turned(urdf, angle):
    """Return a URDF with its roll, pitch and yaw changed."""
    return re.sub(r'rpy="([^"]*)"', lambda m: f'rpy="{" ".join(angle(float(x)) for x in m[1].split())}"', urdf)


def exact(x):
    """Return the multiple of 45 degrees that an angle stands for, or itself."""
    near = round(x / (np.pi / 4)) * np.pi / 4
    return repr(float(near if abs(x - near) < 5e-3 else x))


@pytest.mark.thorough
@pytest.mark.parametrize("name", ARMS)
def test_rounded_angles_do_not_change_the_grouping(name, tmp_path):
    """As shipped, and with two digits, 1.57: the same parameters stay as with exact angles, and all rotors are asked for."""
    (path,) = [f.locate() for f in files("example-robot-data") or () if str(f).endswith(ARMS[name])]
    kept = []
    for file, angle in (("exact", exact), ("shipped", str), ("rounded", lambda x: f"{x:.2f}")):
        (tmp_path / f"{file}.urdf").write_text(turned(path.read_text(), angle))
        tree = kinematic_tree(Robot.load(str(tmp_path / f"{file}.urdf")))
        tree = replace(tree, joints=tuple(replace(joint, armature=True) for joint in tree.joints))
        kept.append(BaseParameters.of(tree, tree_basis(tree)).kept)
    assert len(kept[0]) == len(kept[1]) == len(kept[2])
    assert name not in {"ur3", "z1"} or kept[0] == kept[1] == kept[2]


def test_parameters_whose_names_end_in_no_digit_are_grouped():
    """A spring of the whole robot belongs to no joint, and two like it are one."""

    @dataclass(frozen=True)
    class Wind(AbstractConservativeBlock):
        """A constant torque on joint 1, twice."""

        def parameters(self, n):
            return Parameter("wind", None, "other", "N m"), Parameter("draught", None, "other", "N m")

        def explicit(self, state):
            return {(0, parameter): np.ones_like(state.q[..., 0, :]) for parameter in self.parameters(1)}

        momentum = energy = lambda self, state: {}
        remainder = explicit

    tree = planar(1, [0, 0, -9.81])
    found = BaseParameters.of(tree, tree_basis(tree) + Wind())
    assert "windR" in found.names
    assert "draught" not in found.names
    assert found.grouping(found.names.index("windR")) == "wind + draught"
