"""Shapes and poses against MuJoCo's own, one state at a time."""

import numpy as np
from builders import forward
from scipy.spatial.transform import Rotation

from idbench.sim.robot.scene import Mover, shapes


def test_shapes_moved_by_their_bodies_are_where_mujoco_puts_the_geoms(robot, rng):
    q = rng.uniform(-2, 2, (5, 2))
    moving = Mover(robot).at(q)
    assert len(shapes(robot)) == robot.model.ngeom
    assert {shape.kind for shape in shapes(robot)} == {"box", "cylinder"}
    for k in range(5):
        data = forward(robot, q[k])
        for shape in shapes(robot):
            body = Rotation.from_quat(moving.quaternions[shape.body][k])
            geom = data.geom(shape.name)
            np.testing.assert_allclose(moving.positions[shape.body][k] + body.apply(shape.position), geom.xpos, atol=1e-12)
            turned = (body * Rotation.from_quat(shape.quaternion)).as_matrix()
            np.testing.assert_allclose(turned, geom.xmat.reshape(3, 3), atol=1e-12)
        np.testing.assert_allclose(moving.sites["tool"][k], data.site("tool").xpos, atol=1e-12)
