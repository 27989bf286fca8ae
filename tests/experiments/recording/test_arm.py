"""Arms of any MJCF, drawn: meshes, unnamed bodies, names that mean something to a viewer."""

import mujoco
import numpy as np
import pytest
import rerun as rr

from idbench.experiments.recording.motion_layer import Arm
from idbench.experiments.recording.stream import Stream, time_columns
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.scene import Mover, shapes

MJCF = """
<mujoco>
  <asset>
    <mesh name="wedge" vertex="0 0 0  .1 0 0  0 .1 0  0 0 .1" face="0 2 1  0 1 3  0 3 2  1 2 3"/>
    <material name="paint" rgba=".1 .2 .3 1"/>
  </asset>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 1"/>
    <body>
      <joint name="a joint/with signs" axis="0 0 1"/>
      <geom type="capsule" size=".02 .1" fromto="0 0 0 .2 0 0" material="paint" mass="1"/>
      <geom name="hull" type="box" size=".1 .1 .1" group="3" mass="0"/>
      <body name="fore arm" pos=".2 0 0">
        <joint name="slide" type="slide" axis="1 0 0"/>
        <geom name="mesh" type="mesh" mesh="wedge" mass="1"/>
        <geom name="ghost" type="sphere" size=".1" rgba="0 0 0 0" mass="0"/>
      </body>
    </body>
  </worldbody>
</mujoco>"""


@pytest.fixture
def robot():
    return Robot("made", mujoco.MjModel.from_xml_string(MJCF))


def test_what_mujoco_shows_is_drawn(robot):
    """No floor, nothing of the groups for collisions, nothing invisible; materials colour."""
    drawn = {shape.name: shape for shape in shapes(robot)}
    assert set(drawn) == {"geom1", "mesh"}
    np.testing.assert_allclose(drawn["geom1"].rgba, [0.1, 0.2, 0.3, 1.0], atol=1e-7)
    mesh = drawn["mesh"]
    assert mesh.kind == "mesh"
    assert mesh.faces.shape == (4, 3)
    assert mesh.vertices.shape == (4, 3)
    assert (mesh.faces.max(), mesh.faces.min()) == (3, 0)


def test_a_mesh_lies_where_the_model_says(robot):
    """MuJoCo moves meshes to their centre and principal axes: shape and pose together give the vertices that were written."""
    (mesh,) = [shape for shape in shapes(robot) if shape.kind == "mesh"]
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, np.roll(mesh.quaternion, 1))
    corners = mesh.vertices @ turn.reshape(3, 3).T + mesh.position
    found = {tuple(np.round(corner, 6) + 0.0) for corner in corners}
    assert found == {(0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.0, 0.1, 0.0), (0.0, 0.0, 0.1)}


def test_it_moves_and_is_recorded_under_names_without_signs(robot, reading, tmp_path):
    rr.set_strict_mode(True)
    q, stream = np.array([[0.0, 0.0], [0.5, 0.1], [1.0, 0.2]]), Stream("made")
    arm = Arm(stream, robot, ("true", "planned"))
    arm.move(time_columns(np.arange(3) / 100, 100.0), {"true": q, "planned": 0.5 * q})
    arm.trace(q)
    stream.write(tmp_path / "made.rrd")
    moving = Mover(robot).at(0.5 * q)
    _, position = reading.column(tmp_path / "made.rrd", "world/planned/fore_arm", "Transform3D:translation")
    np.testing.assert_allclose(position, moving.positions["fore arm"], atol=1e-6)
    assert {"world/true/body1/geom1", "world/true/fore_arm/mesh"} <= reading.entities(tmp_path / "made.rrd")
    reading.verify(tmp_path / "made.rrd")
