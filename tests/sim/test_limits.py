"""What a motion must keep: distances, floors, boxes, and limits from files."""

import numpy as np
import pytest

from idbench.sim.errors import RobotError, ScenarioError
from idbench.sim.limits.clearance import Clearance
from idbench.sim.limits.motion_limits import KeepOut, MotionLimits, home_position, limits_of, surroundings
from idbench.sim.robot.robot import Robot

BALLS = """
<mujoco><compiler angle="radian"/><option gravity="0 0 0"/><worldbody>
  <geom name="post" type="sphere" size="0.1" pos="1 0 0.5"/>
  <body pos="0 0 0.5"><joint name="turn" axis="0 0 1" range="-3 3"/><geom name="hub" size="0.2"/><inertial pos="0 0 0" mass="1"
    diaginertia="1 1 1"/>
    <body pos="0.5 0 0"><joint name="reach" type="slide" axis="1 0 0" range="-0.1 1"/><geom name="ball" size="0.1"/>
    <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></body>
</worldbody></mujoco>"""

URDF = """
<robot name="arm"><link name="base"/><link name="link"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="one" type="revolute"><parent link="base"/><child link="link"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="33" velocity="2.5"/></joint></robot>"""


@pytest.fixture
def balls(written):
    return written(BALLS)


@pytest.fixture
def clear(balls):
    robot = Robot.load(balls)
    return Clearance(robot, robot.ranges, 0.05)


def test_distances_are_those_of_spheres(clear):
    q = np.array([[0.0, 0.0], [0.5, 0.3], [3.0, 0.0], [0.2, 0.45]])
    ball = np.stack([(0.5 + q[:, 1]) * np.cos(q[:, 0]), (0.5 + q[:, 1]) * np.sin(q[:, 0])], axis=1)
    post = np.linalg.norm(ball - [1.0, 0.0], axis=1) - 0.2
    found = clear.distances(q, 10.0)
    pair = [clear.names(p) for p in clear.pairs].index(("post", "ball"))
    np.testing.assert_allclose(found[:, pair], post, atol=1e-6)


def test_neighbours_are_left_out_and_what_always_touches_is_told(balls, clear):
    assert ("hub", "ball") not in [clear.names(p) for p in clear.pairs]
    asked = MotionLimits(keep_out=(KeepOut("cage", (-0.1, -0.1, 0.4), (0.1, 0.1, 0.6)),))
    robot = surroundings(balls, asked)
    assert ("hub", "keep_out cage") in [tuple(sorted(p)) for p in Clearance(robot, robot.ranges, 0.05).left_out]


def test_the_slope_of_nearness_is_its_derivative(clear):
    q, h = np.array([[0.1, 0.25], [-0.2, 0.3], [2.0, 0.0]]), 1e-6
    direction = np.array([[0.4, -1.0], [1.0, 0.7], [0.3, 0.3]])
    change = (clear.cost(q + h * direction)[0] - clear.cost(q - h * direction)[0]) / (2 * h)
    cost, slope = clear.cost(q)
    assert cost > 0
    assert np.sum(slope * direction) == pytest.approx(change, rel=1e-5)


def test_the_nearest_is_found_between_coarse_instants(clear):
    """A fast pass within a few milliseconds: the ball sweeps by the post at 20 rad/s."""
    fs = 1000.0
    t = np.arange(0, 0.2, 1 / fs)
    q = np.stack([-2.0 + 20 * t, np.full_like(t, 0.4)], axis=1)
    qd = np.stack([np.full_like(t, 20.0), 0 * t], axis=1)
    touch = clear.nearest(q, qd, fs)
    dense = clear.distances(q, 0.05)
    assert touch.distance == pytest.approx(dense.min())
    assert set(touch.shapes) == {"post", "ball"}
    assert clear.nearest(q[:20], qd[:20], fs) is None


def test_the_floor_is_below_what_the_robot_stands_on():
    robot = surroundings("panda", MotionLimits())
    floor = robot.model.geom("the floor")
    assert floor.pos[2] == pytest.approx(0.0, abs=1e-9)
    none = surroundings("panda", MotionLimits(floor="none"))
    assert none.model.ngeom == robot.model.ngeom - 1


def test_shipped_arms_are_clear_at_home():
    for name in ("scara", "puma560", "panda"):
        robot, asked = Robot.load(name), MotionLimits()
        limits = limits_of(robot, asked)
        clearance = Clearance(surroundings(name, asked), limits.position, 0.01)
        assert clearance.distances(home_position(robot, asked, limits)[None], 0.05).min() > 0.01
        assert not clearance.left_out


def test_a_urdf_says_velocities_and_efforts_but_has_no_shapes(written):
    robot = Robot.load(path := written(URDF, "arm.urdf"))
    bounds = limits_of(robot, MotionLimits())
    assert bounds.velocity.tolist() == [2.5]
    assert bounds.torque.tolist() == [33.0]
    assert not Clearance(surroundings(path, MotionLimits()), bounds.position, 0.01).checks


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({}, "turn, reach has no velocity limit"),
        ({"velocity": (1.0,)}, "turn, reach has no limit of acceleration or torque"),
        ({"position": {"tirn": (0.0, 1.0)}}, "no such joint (did you mean 'turn'?)"),
        ({"position": {"turn": (1.0, 0.0)}}, "the lowest is not below the highest"),
        ({"position": {"turn": (4.0, 5.0)}}, "lies outside the range of its file"),
        ({"velocity": (1.0,), "torque": (5.0,), "home": (9.0, 0.0)}, "puts turn outside its range"),
        ({"velocity": (1.0, 2.0, 3.0), "torque": (5.0,)}, "3 values for 2 joints"),
    ],
)
def test_limits_that_do_not_fit_say_what_to_write(balls, asked, message):
    robot, given = Robot.load(balls), MotionLimits(**asked)
    with pytest.raises(ScenarioError) as error:
        home_position(robot, given, limits_of(robot, given))
    assert message in str(error.value)


def test_a_joint_without_a_range_is_asked_for_one(tmp_path):
    path = tmp_path / "free.xml"
    path.write_text(BALLS.replace(' range="-3 3"', ""))
    with pytest.raises(ScenarioError, match=r"without range: turn; write \[position\] and turn = \[lowest, highest\]"):
        limits_of(Robot.load(str(path)), MotionLimits(velocity=(1.0,)))


def test_numbers_of_a_file_must_be_as_many_as_its_joints(tmp_path):
    path = tmp_path / "wrong.xml"
    path.write_text(BALLS.replace("<worldbody>", '<custom><numeric name="max_velocity" data="1"/></custom><worldbody>'))
    with pytest.raises(RobotError, match="max_velocity has 1 values for 2 joints"):
        Robot.load(str(path)).most("velocity")
