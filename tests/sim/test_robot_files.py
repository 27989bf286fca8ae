"""Robots' files as they are in the wild: mended, held, turned, made of a table; or refused for a reason that holds."""

from importlib.metadata import files

import numpy as np
import pytest
from builders import forward

from idbench.sim.errors import RobotError
from idbench.sim.robot.inverse_dynamics import inverse_dynamics
from idbench.sim.robot.mounting import Mounting, locked
from idbench.sim.robot.placed import numbers, without_rounding
from idbench.sim.robot.rewrite import rewritten
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.tree import kinematic_tree
from idbench.sim.robot.written_xml import urdf_text

SOLID = '<inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>'


def urdf(*links, joints="", head=""):
    inside = "".join(f'<link name="l{i}">{link}</link>' for i, link in enumerate(links))
    made = "".join(
        f'<joint name="j{i}" type="revolute"><parent link="l{i - 1}"/><child link="l{i}"/><origin xyz="0 0 0.3" rpy="0.3 0 0"/>'
        f'<axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="10" velocity="3"/></joint>'
        for i in range(1, len(links))
    )
    return f'<robot name="r" {head}>{inside}{joints or made}</robot>'


@pytest.fixture
def load_urdf(written):
    return lambda text, *edits: Robot.load(written(text, "arm.urdf"), *edits)


@pytest.mark.parametrize(
    ("inertial", "note"),
    [
        ("", "no inertia of l2: 1 g is assumed"),
        (SOLID.replace('"1"', '"0"'), "no inertia of l2"),
        (SOLID.replace('ixx="0.1"', 'ixx="0.9"'), "an inertia of l2 that is impossible"),
        (SOLID.replace("0.1", "0"), "an inertia of l2 that is impossible"),
        (SOLID.replace('ixx="0.1"', 'ixx="-0.1"'), "an inertia of l2 that is impossible"),
    ],
    ids=["none", "no mass", "too long", "zero", "negative"],
)
def test_links_without_an_inertia_that_a_body_has_are_mended(load_urdf, inertial, note):
    """The published TX40, TIAGo's antenna, a dozen of the URDFs of laboratories: identification needs places alone."""
    robot = load_urdf(urdf("", SOLID, inertial))
    assert robot.joints == ("j1", "j2")
    assert any(note in words for words in robot.notes)
    assert load_urdf(urdf("", SOLID, SOLID)).notes == ()


def test_what_is_there_twice_or_not_declared_reads_as_elsewhere(load_urdf):
    """As urdfdom reads it, and with it pinocchio: of two origins the first one; `world` is the ground."""
    plain = urdf("", SOLID)
    twice = load_urdf(plain.replace('<origin xyz="0 0 0.3" rpy="0.3 0 0"/>', '<origin xyz="0 0 0.3"/><origin xyz="0 0 2"/>'))
    once = load_urdf(plain.replace('<link name="l0"></link>', "").replace('rpy="0.3 0 0"', ""))
    assert twice.model.body_pos[-1].tolist() == once.model.body_pos[-1].tolist() == [0, 0, 0.3]
    assert any("a second origin of j1: the first one is taken" in note for note in twice.notes)
    assert any("no link l0" in note for note in once.notes)
    with pytest.raises(RobotError):  # a typo, which would cut the robot in two
        load_urdf(urdf("", SOLID, SOLID).replace('parent link="l1"', 'parent link="L1"'))


def test_a_link_whose_mass_is_welded_to_it_is_left_alone(load_urdf):
    weld = '<joint name="w" type="fixed"><parent link="l1"/><child link="l2"/></joint>'
    turn = '<joint name="j" type="continuous"><parent link="l0"/><child link="l1"/><axis xyz="0 0 1"/></joint>'
    robot = load_urdf(urdf("", "", SOLID, joints=turn + weld))
    assert robot.notes == ()
    assert robot.model.body_mass.sum() == pytest.approx(1.0)


@pytest.mark.parametrize(
    "text",
    [
        urdf("", SOLID, head='xmlns:xacro="http://www.ros.org/wiki/xacro"').replace("<link", "<xacro:arm/><link", 1),
        urdf("", SOLID).replace('"0 0 0.3"', '"0 0 ${height}"'),
    ],
)
def test_a_xacro_is_said_to_be_one(load_urdf, text):
    with pytest.raises(RobotError, match=r"this is a xacro, from which a URDF is made first: xacro arm.urdf.xacro > arm.urdf"):
        load_urdf(text)


def test_joints_that_follow_others_are_held(load_urdf):
    """A gripper whose second finger mimics the first: refused with the way out, and read when it is held."""
    mimic = urdf("", SOLID, SOLID, SOLID).replace('"j3" type="revolute">', '"j3" type="revolute"><mimic joint="j2"/>')
    with pytest.raises(RobotError, match=r"couples joints; hold the joints that follow others \(--lock JOINT=VALUE"):
        kinematic_tree(load_urdf(mimic))
    robot = load_urdf(mimic, Mounting(joints=("j1",)).edit)
    assert robot.joints == ("j1",)
    assert kinematic_tree(robot).n == 1


@pytest.mark.parametrize("name", ["puma560", "panda"])
def test_a_held_joint_is_where_it_is_held(name):
    """Places and torques of the others are those of the whole robot with that joint at rest there."""
    whole = Robot.load(name)
    held = {whole.joints[2]: 0.7, whole.joints[4]: -1.1}
    part = Robot.load(name, Mounting(lock=tuple(held.items())).edit)
    rng = np.random.default_rng(0)
    q, qd, qdd = (rng.uniform(-1, 1, (5, whole.n)) for _ in range(3))
    for j in (2, 4):
        q[:, j], qd[:, j], qdd[:, j] = held[whole.joints[j]], 0.0, 0.0
    rest = [j for j in range(whole.n) if whole.joints[j] not in held]
    expected = inverse_dynamics(whole, q, qd, qdd)[:, rest]
    np.testing.assert_allclose(inverse_dynamics(part, q[:, rest], qd[:, rest], qdd[:, rest]), expected, atol=1e-10)


@pytest.mark.parametrize(
    ("compiler", "turned"),
    [
        ('angle="radian"', 'euler="0.3 0.2 0.9"'),
        ('angle="radian"', 'axisangle="1 2 3 0.7"'),
        ('angle="degree" eulerseq="ZYX"', 'euler="10 20 30"'),
        ('angle="degree"', 'quat="1 0.2 0.3 0.4"'),
    ],
)
def test_a_held_body_stands_where_it_stood_however_its_file_says_it(load_robot, compiler, turned):
    ref, range_ = ("0.7", "-2 2") if "radian" in compiler else ("40", "-120 120")
    text = f"""<mujoco><compiler {compiler}/><worldbody><body><joint name="first"/><geom size="0.1"/>
      <body pos="0.1 0.2 0.3" {turned}><joint name="held" axis="1 1 0" pos="0.1 0 0.2" ref="{ref}" range="{range_}"/>
      <geom size="0.1"/><body name="tip" pos="0.3 0.2 0.1"><joint name="last" axis="0 0 1"/><geom size="0.1"/>
      </body></body></body></worldbody></mujoco>"""
    whole, held = load_robot(text), load_robot(text, Mounting(lock=(("held", 0.5),)).edit)
    places = []
    for robot, q in ((whole, [0.2, 0.5, -0.3]), (held, [0.2, -0.3])):
        tip = forward(robot, q).body("tip")
        places.append(np.concatenate([tip.xpos, tip.xmat]))
    np.testing.assert_allclose(places[1], places[0], atol=1e-12)


def test_one_of_several_joints_of_a_body_is_not_held(load_robot):
    text = """<mujoco><worldbody><body name="b"><joint name="x" axis="1 0 0"/><joint name="y" axis="0 1 0"/><geom size="0.1"/>
      </body></worldbody></mujoco>"""
    with pytest.raises(RobotError, match="y is one of several joints of body 'b'"):
        load_robot(text, Mounting(lock=(("y", 0.5),)).edit)


def test_limits_go_with_the_joints_that_are_held():
    whole, part = Robot.load("panda"), Robot.load("panda", Mounting(lock=((Robot.load("panda").joints[2], 0.5),)).edit)
    rest = [j for j in range(7) if j != 2]
    np.testing.assert_array_equal(part.most("velocity"), whole.most("velocity")[rest])
    np.testing.assert_array_equal(part.torque_limits, whole.torque_limits[rest])


def test_a_slide_and_a_ball_are_held(load_robot):
    text = """<mujoco><worldbody><body><joint name="rail" type="slide" axis="0 1 0" ref="0.1"/><geom size="0.1"/>
      <body><joint name="b" type="ball"/><geom size="0.1"/><body name="tip" pos="0 0 1"><joint name="t" axis="0 1 0"/>
      <geom size="0.1"/></body></body></body></worldbody>
      <actuator><motor joint="rail"/><motor name="m" joint="t"/></actuator><sensor><jointpos joint="rail"/></sensor>
      <keyframe><key qpos="0.1 1 0 0 0 0"/></keyframe></mujoco>"""
    robot = load_robot(text, Mounting(("t",), (("rail", 0.4),)).edit)
    assert (robot.joints, robot.model.nu, robot.model.nsensor, robot.model.nkey) == (("t",), 1, 0, 0)
    np.testing.assert_allclose(forward(robot, robot.model.qpos0).body("tip").xpos, [0, 0.3, 1], atol=1e-12)


def test_locks_are_read():
    assert locked(["a=1", "b=-2e-3"]) == (("a", 1.0), ("b", -2e-3))


def test_a_robot_on_a_wall_has_its_gravity_aside(load_urdf):
    wall = load_urdf(urdf("", SOLID, SOLID), Mounting(gravity=(9.81, 0.0, 0.0)).edit)
    np.testing.assert_array_equal(kinematic_tree(wall).gravity, [9.81, 0, 0])


def test_meshes_that_are_not_there_cost_a_robot_its_looks_alone(load_robot):
    text = """<mujoco><asset><mesh name="m" file="gone.stl"/></asset><worldbody><body name="a"><joint axis="0 0 1"/>
      <inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/><geom type="mesh" mesh="m"/>
      <body name="b"><joint axis="0 1 0"/><geom type="mesh" mesh="m"/></body></body></worldbody></mujoco>"""
    robot = load_robot(text)
    assert robot.model.body("a").mass[0] == 2
    assert "meshes that are not there (m)" in robot.notes[0]
    assert "no inertia of b but that of its mesh" in robot.notes[1]


def test_every_robot_of_a_public_collection_reads_or_is_refused_for_a_reason():
    """example-robot-data: 68 URDFs of arms, legs, hands; refused are closed chains, drones, and a file without joints."""
    paths = [f.locate() for f in files("example-robot-data") or () if str(f).endswith(".urdf")]
    refused = {}
    for path in paths:
        try:
            kinematic_tree(Robot.load(str(path)))
        except RobotError as error:
            refused[path.stem] = str(error)
    assert len(paths) > 60
    for name, why in refused.items():
        assert "closes a chain or couples joints" in why or "has no joints" in why, (name, why)
    assert len(refused) < 14


def test_an_arm_with_classes_a_gripper_by_tendon_and_keyframes_reads(load_robot, tmp_path):
    """As the models of MuJoCo's menagerie are written: the fingers are tied, driven through a tendon, and not in the log."""
    text = """<mujoco model="arm"><compiler angle="radian" meshdir="assets"/>
      <default><default class="arm"><joint armature="0.1" damping="1" axis="0 0 1" range="-2.8 2.8"/>
        <general biastype="affine" ctrlrange="-2.8 2.8"/>
        <default class="finger"><joint type="slide" axis="0 1 0" range="0 0.04" armature="0.2"/></default></default></default>
      <asset><mesh name="link" file="link.stl"/></asset>
      <worldbody><light pos="0 0 1"/><body name="link1" childclass="arm" pos="0 0 0.3"><inertial pos="0 0 0.1" mass="3"
        diaginertia="0.1 0.1 0.1"/><joint name="joint1"/><geom type="mesh" mesh="link"/>
        <body name="link2" quat="1 -1 0 0"><joint name="joint2"/><inertial pos="0.1 0 0" mass="2" diaginertia="0.1 0.1 0.1"/>
          <body name="left"><joint name="finger1" class="finger"/><geom size="0.01"/></body>
          <body name="right" quat="0 0 0 1"><joint name="finger2" class="finger"/><geom size="0.01"/></body></body></body>
      </worldbody>
      <tendon><fixed name="split"><joint joint="finger1" coef="0.5"/><joint joint="finger2" coef="0.5"/></fixed></tendon>
      <equality><joint joint1="finger1" joint2="finger2"/></equality>
      <actuator><general class="arm" name="a1" joint="joint1" gainprm="4500" biasprm="0 -4500 -450"/>
        <general class="arm" name="a2" joint="joint2" gainprm="4500" biasprm="0 -4500 -450"/>
        <general class="arm" name="grip" tendon="split" ctrlrange="0 255"/></actuator>
      <contact><exclude body1="link1" body2="link2"/></contact>
      <sensor><tendonpos tendon="split"/><jointpos joint="joint1"/><actuatorpos actuator="grip"/></sensor>
      <keyframe><key name="home" qpos="0 0.5 0.04 0.04" ctrl="0 0.5 255"/></keyframe></mujoco>"""
    with pytest.raises(RobotError, match="closes a chain or couples joints"):
        kinematic_tree(load_robot(text))
    mounting = Mounting(joints=("joint1", "joint2"))
    robot = load_robot(text, mounting.edit)
    model = robot.model
    assert robot.joints == ("joint1", "joint2")
    assert (model.nu, model.ntendon, model.neq, model.nkey, model.nsensor, model.nexclude) == (2, 0, 0, 0, 1, 1)
    assert kinematic_tree(robot).joints[1].armature
    (tmp_path / "out.xml").write_text(rewritten(str(tmp_path / "arm.xml"), {"M2": 2.5}, tmp_path, mounting))
    assert Robot.load(str(tmp_path / "out.xml")).joints == ("joint1", "joint2")


FINGER = """<body name="{0}" pos="0 {1} .2"><joint name="{0}" axis="1 0 0"/>
<inertial pos="0 0 .1" mass=".1" diaginertia=".01 .01 .01"/></body>"""

GRIPPER = f"""<mujoco><worldbody><body name="arm"><joint name="arm" axis="0 0 1"/>
<inertial pos="0 0 .1" mass="1" diaginertia=".1 .1 .1"/>{FINGER.format("left", 0.1)}{FINGER.format("right", -0.1)}
</body><body name="hand" mocap="true"/></worldbody><equality>{{}}</equality></mujoco>"""


@pytest.mark.parametrize(
    ("tie", "open_"),
    [
        ('<connect body1="left" body2="right" anchor="0 0 .1"/>', True),
        ('<weld body1="left" body2="right"/>', True),
        ('<weld body1="arm" body2="hand"/>', True),
        ('<weld body1="arm"/>', False),
    ],
    ids=["connect", "weld", "mocap", "world"],
)
def test_ties_of_bodies_that_move_as_one_are_left_out_and_said(load_robot, tie, open_):
    """A gripper of four bars on an arm of which the arm alone was logged; a weld to a mocap body, as in teleoperation."""
    held = Mounting(joints=("arm",))
    if not open_:
        with pytest.raises(RobotError, match="closes a chain"):
            kinematic_tree(load_robot(GRIPPER.format(tie), held.edit))
        return
    robot = load_robot(GRIPPER.format(tie), held.edit)
    assert [joint.name for joint in kinematic_tree(robot).joints] == ["arm"]
    assert len(robot.notes) == 1
    assert "ties that hold nothing that moves" in robot.notes[0]
    with pytest.raises(RobotError, match="closes a chain"):
        kinematic_tree(load_robot(GRIPPER.format('<connect body1="left" body2="right" anchor="0 0 .1"/>')))


def test_prefixes_that_nothing_declares_are_read_and_written(load_urdf, tmp_path):
    drake = '<drake:reducing_gear value="1"/></joint>'
    text = urdf("", SOLID).replace("</joint>", drake)
    robot = load_urdf(text)
    assert robot.joints == ("j1",)
    assert "drake:reducing_gear" in urdf_text(str(tmp_path / "arm.urdf"), robot, kinematic_tree(robot), {}, Mounting())


def test_a_line_that_is_named_is_that_of_the_file(load_urdf):
    shape = "<visual>\n<geometry>\n<box size='1 1 1'/>\n</geometry>\n</visual>"
    text = "<!-- one\ntwo -->\n" + urdf(shape, SOLID).replace('upper="2"', '\n\nupper="two"')
    with pytest.raises(RobotError, match=r"upper.* line 7"):
        load_urdf(text)


def test_a_part_of_a_file_names_the_file_to_give(load_robot, tmp_path):
    (tmp_path / "scene.xml").write_text('<mujoco><include file="part.xml"/></mujoco>')
    with pytest.raises(RobotError, match=r"a part that another includes: give .*scene\.xml"):
        load_robot("<mujocoinclude><body/></mujocoinclude>", name="part.xml")


def test_what_rounding_made_of_zero_is_written_as_zero_and_small_numbers_are_kept():
    written = numbers(np.array([0.3, 0.1 + 0.2 - 0.3, 1e-9]))
    assert [float(x) for x in written.split()] == [0.3, 0.0, 1e-9]
    assert without_rounding(np.array([1e-20, 3e-20])).tolist() == [1e-20, 3e-20]
