"""The arm in 3D: as it is, as it was planned to be, and as its encoders see it."""

from collections.abc import Mapping
from typing import Literal

import numpy as np
import rerun as rr

from idbench.experiments.recording.columns import Times, part, poses
from idbench.experiments.recording.stream import Stream
from idbench.experiments.text import MEASURED, PLANNED, Color
from idbench.identify import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.scene import Mover, SceneShape, motion, shapes

ROLES: dict[str, Color | None] = {"true": None, "measured": MEASURED, "planned": PLANNED}
"""Arms that may be shown, and the colour of those that are drawn as wires around the first."""


class Arm:
    """The arms of a recording.

    Parameters
    ----------
    stream : Stream
        Where they go.
    robot : Robot
        What they look like.
    roles : tuple of str
        Those of ROLES that are shown; the first is drawn solid.
    """

    def __init__(self, stream: Stream, robot: Robot, roles: tuple[str, ...]) -> None:
        self._stream = stream
        self._robot = robot
        self._mover = Mover(robot)
        two = motion(robot, np.stack([np.zeros(robot.n), np.full(robot.n, 0.1)]))
        pose = {body: np.concatenate([x, two.quaternions[body]], axis=1) for body, x in two.positions.items()}
        self._moving = {body for body, (at, moved) in pose.items() if not np.array_equal(at, moved)}
        stream.keep("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP)
        for body in pose.keys() - self._moving:
            where = rr.Transform3D(translation=two.positions[body][0], quaternion=rr.Quaternion(xyzw=two.quaternions[body][0]))
            stream.keep(f"world/{roles[0]}/{part(body)}", where)
        for role in roles:
            for shape in shapes(robot):
                if role == roles[0] or shape.body in self._moving:
                    path = f"world/{role}/{part(shape.body)}/{part(shape.name)}"
                    stream.keep(path, _drawn(shape, None if role == roles[0] else ROLES[role]), _pose(shape))

    def move(self, times: Times, where: Mapping[str, Array]) -> None:
        """Send where arms are, by their role, at positions [rad] of shape (time, joint)."""
        moving = self._mover.at(np.concatenate(list(where.values())))
        for k, (role, q) in enumerate(where.items()):
            mine = slice(k * len(q), (k + 1) * len(q))
            for body in self._moving:
                at, turned = moving.positions[body][mine], moving.quaternions[body][mine]
                self._stream.send(f"world/{role}/{part(body)}", times, poses(at, turned))

    def trace(self, q: Array) -> None:
        """Draw the way of every site along `q` [rad], shape (time, joint)."""
        for site, position in motion(self._robot, q).sites.items():
            self._stream.keep(
                f"world/path_of_{part(site)}", rr.LineStrips3D([position], radii=[0.0015], colors=[[190, 190, 190]])
            )


Fill = Literal["solid", "majorwireframe"]


def _pose(shape: SceneShape) -> rr.Transform3D:
    return rr.Transform3D(translation=shape.position, quaternion=rr.Quaternion(xyzw=shape.quaternion))


def _drawn(shape: SceneShape, wire: Color | None) -> rr.AsComponents:
    """Return a shape: solid in its own colour, or as wires of the colour `wire`."""
    color, size = [shape.rgba if wire is None else wire], shape.size
    fill: Fill = "solid" if wire is None else "majorwireframe"
    match shape.kind:
        case "box":
            return rr.Boxes3D(half_sizes=[size], colors=color, fill_mode=fill)
        case "cylinder":
            return rr.Cylinders3D(lengths=[2 * size[1]], radii=[size[0]], colors=color, fill_mode=fill)
        case "capsule":  # rerun's starts at the origin, MuJoCo's is centred there
            centre = [[0.0, 0.0, -size[1]]]
            return rr.Capsules3D(lengths=[2 * size[1]], radii=[size[0]], translations=centre, colors=color, fill_mode=fill)
        case "sphere":
            return rr.Ellipsoids3D(half_sizes=[[size[0]] * 3], colors=color, fill_mode=fill)
        case "ellipsoid":
            return rr.Ellipsoids3D(half_sizes=[size], colors=color, fill_mode=fill)
        case "mesh":
            return _mesh(shape, wire)


def _mesh(shape: SceneShape, wire: Color | None) -> rr.AsComponents:
    if wire is None:
        return rr.Mesh3D(vertex_positions=shape.vertices, triangle_indices=shape.faces, albedo_factor=shape.rgba)
    low, high = shape.vertices.min(axis=0), shape.vertices.max(axis=0)  # every edge of a mesh would hide the arm
    return rr.Boxes3D(half_sizes=[(high - low) / 2], centers=[(high + low) / 2], colors=[wire], fill_mode="majorwireframe")
