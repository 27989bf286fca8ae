"""What a robot looks like: shapes on moving bodies, for any viewer."""

from dataclasses import dataclass
from typing import Literal

import mujoco
import numpy as np
from mujoco import mjtStage
from mujoco.batch import Batch

from sim.motors import Array
from sim.robot import Robot

Kind = Literal["sphere", "capsule", "ellipsoid", "cylinder", "box"]

_KINDS: dict[int, Kind] = {
    int(mujoco.mjtGeom.mjGEOM_SPHERE): "sphere",
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): "capsule",
    int(mujoco.mjtGeom.mjGEOM_ELLIPSOID): "ellipsoid",
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): "cylinder",
    int(mujoco.mjtGeom.mjGEOM_BOX): "box",
}


@dataclass(frozen=True, eq=False)
class Shape:
    """One geom.

    Parameters
    ----------
    name, body : str
        Its name and the body that carries it.
    kind : str
        Sphere, capsule, ellipsoid, cylinder or box; capsules and cylinders along z, all centred.
    size : Array, shape (3,)
        MuJoCo's sizes [m]: radius; radius and half length; half lengths.
    position : Array, shape (3,)
        In the body's frame [m].
    quaternion : Array, shape (4,)
        Orientation in the body's frame, x y z w.
    rgba : Array, shape (4,)
        Colour, 0 to 1.
    """

    name: str
    body: str
    kind: Kind
    size: Array
    position: Array
    quaternion: Array
    rgba: Array


@dataclass(frozen=True, eq=False)
class Motion:
    """Poses in the world.

    Parameters
    ----------
    positions : dict
        Of every body, by name: (time, 3) [m].
    quaternions : dict
        Of every body, by name: (time, 4), x y z w.
    sites : dict
        Positions of every site, by name: (time, 3) [m].
    """

    positions: dict[str, Array]
    quaternions: dict[str, Array]
    sites: dict[str, Array]


def shapes(robot: Robot) -> list[Shape]:
    """Return the visible shapes of the robot; planes and meshes are left out."""
    model, found = robot.model, []
    for g in range(model.ngeom):
        kind, geom = _KINDS.get(int(model.geom_type[g])), model.geom(g)
        if kind is None or geom.rgba[3] == 0:
            continue
        body = model.body(int(model.geom_bodyid[g])).name
        name = geom.name or f"geom{g}"
        found.append(Shape(name, body, kind, geom.size.copy(), geom.pos.copy(), _xyzw(geom.quat), geom.rgba.astype(float)))
    return found


def motion(robot: Robot, q: Array) -> Motion:
    """Return where the bodies and sites are at the positions `q` [rad], shape (time, joint)."""
    states, model = Batch(robot.model, len(q)), robot.model
    xpos, xquat, site_xpos = states.bind("xpos"), states.bind("xquat"), states.bind("site_xpos")
    states.bind("qpos")[:] = q
    states.forward(stage=mjtStage.mjSTAGE_POS.value)
    bodies = {model.body(b).name: b for b in range(1, model.nbody)}
    return Motion(
        {name: xpos[:, b].copy() for name, b in bodies.items()},
        {name: _xyzw(xquat[:, b]) for name, b in bodies.items()},
        {model.site(s).name: site_xpos[:, s].copy() for s in range(model.nsite)},
    )


def _xyzw(wxyz: Array) -> Array:
    return np.roll(wxyz, -1, axis=-1)
