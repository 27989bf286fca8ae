"""Tables of Denavit and Hartenberg, of both conventions, as robots."""

import numpy as np
import pytest
from builders import forward

from idbench.sim.robot.mounting import Mounting
from idbench.sim.robot.rewrite import rewritten
from idbench.sim.robot.robot import Robot

KHALIL = """
angles = "deg"
[[joints]]
name = "base"
[[joints]]
alpha = 90.0
theta = 20.0
[[joints]]
d = 0.45
r = 0.1
range = [-120.0, 120.0]
[[joints]]
sigma = 1
alpha = -90.0
r = 0.38
"""


def test_a_table_of_khalil_and_kleinfinger(load_robot):
    """Places by the product of the table's own matrices, multiplied out here."""
    robot, q = load_robot(KHALIL, name="arm.toml"), np.array([0.3, -0.4, 0.8, 0.15])
    table = ((0, 0, 0, 0), (np.pi / 2, 0, np.radians(20), 0), (0, 0.45, 0, 0.1), (-np.pi / 2, 0, 0, 0.38))
    place = np.eye(4)
    for j, (alpha, d, theta, r) in enumerate(table):
        turn, way = (theta + q[j], r) if j < 3 else (theta, r + q[j])
        ca, sa, ct, st = np.cos(alpha), np.sin(alpha), np.cos(turn), np.sin(turn)
        place = place @ [[ct, -st, 0, d], [ca * st, ca * ct, -sa, -way * sa], [sa * st, sa * ct, ca, way * ca], [0, 0, 0, 1]]
    data = forward(robot, q)
    np.testing.assert_allclose(data.xpos[-1], place[:3, 3], atol=1e-12)
    np.testing.assert_allclose(data.xmat[-1].reshape(3, 3), place[:3, :3], atol=1e-12)
    assert robot.weightless
    np.testing.assert_allclose(robot.ranges[2], np.radians([-120, 120]))


def test_a_classic_table_moves_as_the_puma_of_corke(load_robot):
    """The PUMA's table (P. Corke, Robotics Toolbox) against the arm that ships, whose frames are others: how the last link
    moves, seen from where it was."""
    rows = ((90, 0, 0), (0, 0.4318, 0), (-90, 0.0203, 0.15005), (90, 0, 0.4318), (-90, 0, 0), (0, 0, 0))
    text = 'convention = "classic"\nangles = "deg"\n'
    text += "".join(f"[[joints]]\nalpha = {alpha}\na = {a}\nd = {d}\n" for alpha, a, d in rows)
    robot, q = load_robot(text, name="arm.toml"), np.array([0.3, -0.4, 0.8, 0.15, 0.5, -0.6])
    place = np.eye(4)
    for (alpha, a, d), theta in zip(rows, q, strict=True):
        ca, sa, ct, st = np.cos(np.radians(alpha)), np.sin(np.radians(alpha)), np.cos(theta), np.sin(theta)
        place = place @ [[ct, -st * ca, st * sa, a * ct], [st, ct * ca, -ct * sa, a * st], [0, sa, ca, d], [0, 0, 0, 1]]
    data = forward(robot, q)
    np.testing.assert_allclose(data.xpos[-1], place[:3, 3], atol=1e-12)  # the wrist's axes meet: a and d of the last are 0


def test_a_table_and_a_held_robot_are_written_as_mjcf(written, tmp_path):
    (tmp_path / "out.xml").write_text(rewritten(written(KHALIL, "arm.toml"), {"M4": 2.0, "XX4": 0.5, "YY4": 0.5, "ZZ4": 0.5}))
    assert Robot.load(str(tmp_path / "out.xml")).model.body_mass[-1] == pytest.approx(2.0)
    mounting = Mounting(lock=((Robot.load("panda").joints[6], 0.5),))
    (tmp_path / "held.xml").write_text(rewritten("panda", {}, tmp_path, mounting))
    assert Robot.load(str(tmp_path / "held.xml")).n == 6
