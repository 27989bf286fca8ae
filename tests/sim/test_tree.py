"""Descriptions read from compiled models: against MuJoCo's own dynamics, and refused where they would be wrong."""

import mujoco
import numpy as np
import pytest
from builders import arm

from idbench.identify import State
from idbench.identify.arrays import combined
from idbench.sim.errors import RobotError
from idbench.sim.robot.inverse_dynamics import coulomb_torque, inverse_dynamics
from idbench.sim.robot.mounting import Mounting
from idbench.sim.robot.rewrite import rewritten
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.tree import kinematic_tree, standard_parameters

CROOKED = """
<mujoco model="crooked">
  <compiler angle="degree"/>
  <option gravity="1 -2 -9"/>
  <worldbody>
    <body pos="0.1 0.2 0.3" euler="10 20 30">
      <body name="shoulder" pos="0.1 0 0.2" euler="0 40 0">
        <joint name="yaw" axis="1 2 3" pos="0.05 0.1 -0.1" damping="0.3" frictionloss="0.2" armature="0.1" ref="15"/>
        <joint name="pitch" axis="0 1 0.2" pos="-0.1 0 0.1" damping="0.2"/>
        <geom type="box" size="0.1 0.2 0.3" pos="0.1 0.2 0" euler="5 6 7" density="300"/>
        <body name="flange" pos="0.3 0.1 0" euler="0 0 50">
          <geom type="capsule" size="0.05 0.2" density="500"/>
          <body name="rail" pos="0.2 0 0.1" euler="20 0 0">
            <joint name="lift" type="slide" axis="1 1 0" armature="0.4" frictionloss="0.1" ref="0.1" range="-1 1"/>
            <geom type="ellipsoid" size="0.1 0.2 0.1" pos="0.1 0 0" density="400"/>
          </body>
        </body>
        <body name="hand" pos="-0.2 0.1 0.1" euler="0 70 0">
          <joint name="wrist" axis="0 0 1" pos="0.1 0.1 0"/>
          <geom type="box" size="0.1 0.05 0.3" pos="0 0.2 0" density="200"/>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
"""Welded bodies, two hinges on one body beside their frames, a slide, two branches, references, gravity askew."""


@pytest.mark.parametrize("name", ["crooked", "scara", "puma560", "panda"])
def test_columns_times_truth_are_mujocos_inverse_dynamics(name, written, rng):
    robot, _, found, X = arm(written(CROOKED) if name == "crooked" else name)
    states = rng.uniform(-3, 3, (3, robot.n, 200))
    q, qd, qdd = (x.T for x in states)
    tau = (inverse_dynamics(robot, q, qd, qdd) + coulomb_torque(robot, qd)).T
    for basis, values in ((found.standard, X), (found.basis, found.base(X))):
        columns = basis.explicit(State(*states[:2], lambda _: states[2]))
        np.testing.assert_allclose(combined(columns, values, np.zeros_like(tau)), tau, atol=1e-10)


def test_links_and_joints_are_those_of_the_file(written):
    tree = kinematic_tree(Robot.load(written(CROOKED)))
    assert [joint.name for joint in tree.joints] == ["yaw", "pitch", "lift", "wrist"]
    assert [joint.parent for joint in tree.joints] == [-1, 0, 1, 1]
    assert [joint.kind for joint in tree.joints] == ["hinge", "hinge", "slide", "hinge"]
    assert [joint.massive for joint in tree.joints] == [False, True, True, True]
    assert [joint.armature for joint in tree.joints] == [True, False, True, False]
    assert tree.joints[2].range == (-1.0, 1.0)
    assert tree.joints[0].range == (-np.inf, np.inf)
    np.testing.assert_array_equal(tree.gravity, [1, -2, -9])


def one(joint, extra="", inside='<geom size="0.1"/>'):
    return f'<mujoco><worldbody><body name="a">{joint}{inside}</body></worldbody>{extra}</mujoco>'


PAIR = '<geom size="0.1"/><body name="b" pos="1 0 0"><joint name="second"/><geom size="0.1"/></body>'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (one('<freejoint name="float"/>'), "has no joints"),
        (one('<joint name="ball" type="ball"/>'), r"'ball' of body 'a' does not"),
        (
            one('<joint name="first"/>', '<equality><connect name="loop" body1="b" anchor="0 0 0"/></equality>', PAIR),
            r"connect 'loop' \(a and b\) closes a chain|connect 'loop' \(b and world\) closes a chain",
        ),
        (
            one('<joint name="first"/>', '<equality><joint name="mimic" joint1="first" joint2="second"/></equality>', PAIR),
            r"joint 'mimic' \(first and second\) closes a chain or couples joints",
        ),
        (
            one(
                '<joint name="first"/>',
                '<tendon><spatial name="belt" stiffness="1"><site site="s"/><site site="t"/></spatial></tendon>',
                '<geom size="0.1"/><site name="s"/><site name="t" pos="0.1 0 0"/>',
            ),
            "tendon 'belt' closes a chain or couples joints",
        ),
        (one('<joint name="light"/>', inside=""), "give every body that a joint moves a mass and an inertia"),
        ("<mujoco><worldbody>", "MuJoCo cannot read"),
        ("<mujoco/>", "has no joints"),
    ],
)
def test_what_is_no_open_tree_is_refused_by_name(text, message, written):
    with pytest.raises(RobotError, match=message):
        kinematic_tree(Robot.load(written(text)))


def test_a_floating_base_is_held_and_joints_without_names_get_some(written):
    """The robot is then that which stands on the ground."""
    base, rest = '<body><freejoint/><geom size="0.1"/>', f'<body pos="1 0 0"><joint axis="0 1 0"/>{PAIR}</body></body>'
    path = written(f"<mujoco><worldbody>{base}{rest}</worldbody></mujoco>")
    held, named = Robot.load(path), Robot.load(path, Mounting(lock=(("joint1", 0.0),)).edit)
    assert held.joints == named.joints == ("joint2", "second")
    assert (len(held.notes), len(named.notes)) == (1, 0)
    assert "it is held where the file has it" in held.notes[0]
    fixed = Robot.load(written(f"<mujoco><worldbody><body>{rest}</worldbody></mujoco>"))
    assert fixed.joints == ("joint1", "second")
    q = np.random.default_rng(0).standard_normal((3, 5, 2))
    np.testing.assert_allclose(inverse_dynamics(held, *q), inverse_dynamics(fixed, *q), atol=1e-12)


def test_a_urdf_needs_no_meshes(written):
    shape = '<visual><geometry><mesh filename="package://gone/visual.dae"/></geometry></visual>'
    inertial = '<inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    links = f'<link name="ground"/><link name="arm">{inertial}{shape}</link>'
    joint = '<joint name="turn" type="revolute"><parent link="ground"/><child link="arm"/><axis xyz="0 0 1"/>'
    text = f'<robot name="r">{links}{joint}<limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>'
    robot = Robot.load(written(text, "arm.urdf"))
    assert robot.joints == ("turn",)
    assert standard_parameters(robot)["M1"] == 2


@pytest.mark.parametrize("name", ["crooked", "scara", "puma560", "panda"])
def test_a_rewritten_file_compiles_to_what_was_written(name, written, rng):
    """By MuJoCo's inverse dynamics; comments and everything that has no parameter stay."""
    path = written(CROOKED) if name == "crooked" else name
    robot = Robot.load(path)
    truth = standard_parameters(robot)
    factor = {key: rng.uniform(0.8, 1.2) for key in ("links", "Ia", "Fv", "Fs")}
    wanted = {key: value * factor[letters if (letters := key[:2]) in factor else "links"] for key, value in truth.items()}
    text = rewritten(path, wanted)
    made = Robot(name, mujoco.MjSpec.from_string(text).compile())
    assert {key: pytest.approx(value, abs=1e-9) for key, value in wanted.items()} == standard_parameters(made)
    q = rng.uniform(-2, 2, (20, robot.n))
    still = np.zeros_like(q)
    ratio = inverse_dynamics(made, q, still, still) - factor["links"] * inverse_dynamics(robot, q, still, still)
    np.testing.assert_allclose(ratio, 0, atol=1e-9)
    if name == "panda":
        assert "feasible set of" in text
        assert text.count("<geom") == Robot.path(name).read_text().count("<geom")


def test_impossible_links_are_not_written():
    robot = Robot.load("scara")
    truth = standard_parameters(robot)
    with pytest.raises(RobotError, match="link 2 with a mass of 2 kg and this inertia is not physically consistent"):
        rewritten("scara", {**truth, "ZZ2": 0.001})


def test_inclusions_are_put_in_their_places(written, tmp_path):
    (tmp_path / "link.xml").write_text(
        '<mujocoinclude><joint name="turn"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></mujocoinclude>'
    )
    path = written('<mujoco><worldbody><body name="a"><include file="link.xml"/></body></worldbody></mujoco>')
    text = rewritten(path, {**standard_parameters(Robot.load(path)), "M1": 3.0})
    assert "include" not in text
    made = Robot("x", mujoco.MjSpec.from_string(text).compile())
    assert standard_parameters(made)["M1"] == 3.0


def test_what_stands_around_the_robot_stays_and_every_asset_is_found(written, tmp_path):
    """A licence before the element, two compilers, a mesh in a folder of its own, read from another folder."""
    (tmp_path / "arm" / "sub").mkdir(parents=True)
    corners = "\n".join(f"v {x} {y} {z}" for x in (0, 1) for y in (0, 1) for z in (0, 1))
    (tmp_path / "arm" / "sub" / "box.obj").write_text(corners + "\nf 1 2 3\nf 2 3 4\nf 5 6 7\nf 6 7 8\nf 1 2 5\nf 3 4 7\n")
    asset, inside = '<asset><mesh name="m" file="box.obj"/></asset>', '<geom type="mesh" mesh="m"/>'
    compilers = '<compiler angle="radian"/><compiler meshdir="sub"/>'
    body = one('<joint name="turn"/>', asset, inside).replace("<mujoco>", f"<mujoco>{compilers}")
    path = written(f"<!-- a licence -->\n{body}\n<!-- the end -->\n", "arm/arm.xml")
    truth = standard_parameters(Robot.load(path))
    text = rewritten(path, truth, tmp_path)
    assert text.startswith("<!-- a licence -->\n<mujoco>")
    assert text.endswith("<!-- the end -->\n")
    (tmp_path / "out.xml").write_text(text)
    assert standard_parameters(Robot.load(str(tmp_path / "out.xml"))) == pytest.approx(truth, abs=1e-9)
