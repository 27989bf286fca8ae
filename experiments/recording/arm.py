"""The arm in 3D."""

from collections.abc import Sequence

import rerun as rr

from identify import Array
from sim.robot import Robot
from sim.scene import Shape, motion, shapes


def send_arm(recording: rr.RecordingStream, robot: Robot, q: Array, times: Sequence[rr.TimeColumn]) -> None:
    """Send the robot's shapes, their motion along `q` [rad], shape (time, joint), and the paths of its sites."""
    recording.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    for shape in shapes(robot):
        path = f"world/{shape.body}/{shape.name}"
        recording.log(path, _solid(shape), static=True)
        recording.log(path, _pose(shape), static=True)
    moving = motion(robot, q)
    for body, position in moving.positions.items():
        poses = rr.Transform3D.columns(translation=position, quaternion=moving.quaternions[body])
        recording.send_columns(f"world/{body}", times, poses)
    for site, position in moving.sites.items():
        strip = rr.LineStrips3D([position], radii=[0.0015], colors=[[190, 190, 190]])
        recording.log(f"world/path_of_{site}", strip, static=True)


def _pose(shape: Shape) -> rr.Transform3D:
    return rr.Transform3D(translation=shape.position, quaternion=rr.Quaternion(xyzw=shape.quaternion))


def _solid(shape: Shape) -> rr.AsComponents:
    rgba, size = [shape.rgba], shape.size
    match shape.kind:
        case "box":
            return rr.Boxes3D(half_sizes=[size], colors=rgba, fill_mode="solid")
        case "cylinder":
            return rr.Cylinders3D(lengths=[2 * size[1]], radii=[size[0]], colors=rgba, fill_mode="solid")
        case "capsule":  # rerun's starts at the origin, MuJoCo's is centred there
            centre = [[0.0, 0.0, -size[1]]]
            return rr.Capsules3D(lengths=[2 * size[1]], radii=[size[0]], translations=centre, colors=rgba, fill_mode="solid")
        case "sphere":
            return rr.Ellipsoids3D(half_sizes=[[size[0]] * 3], colors=rgba, fill_mode="solid")
        case "ellipsoid":
            return rr.Ellipsoids3D(half_sizes=[size], colors=rgba, fill_mode="solid")
