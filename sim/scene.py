"""What a robot looks like: shapes on moving bodies, for any viewer."""

from dataclasses import dataclass
from typing import Literal

import mujoco
import numpy as np
import numpy.typing as npt
from mujoco import mjtStage
from mujoco.batch import Batch

from sim.motors import Array
from sim.robot import Robot

Kind = Literal["sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh"]

_KINDS: dict[int, Kind] = {
    int(mujoco.mjtGeom.mjGEOM_SPHERE): "sphere",
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): "capsule",
    int(mujoco.mjtGeom.mjGEOM_ELLIPSOID): "ellipsoid",
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): "cylinder",
    int(mujoco.mjtGeom.mjGEOM_BOX): "box",
    int(mujoco.mjtGeom.mjGEOM_MESH): "mesh",
}

HIDDEN = 3
"""Geoms of this group and higher are not drawn, as in MuJoCo's own viewer: they are there for collisions."""


@dataclass(frozen=True, eq=False)
class Shape:
    """One geom.

    Parameters
    ----------
    name, body : str
        Its name and the body that carries it.
    kind : str
        Sphere, capsule, ellipsoid, cylinder, box or mesh; capsules and cylinders along z, all but meshes centred.
    size : Array, shape (3,)
        MuJoCo's sizes [m]: radius; radius and half length; half lengths.
    position : Array, shape (3,)
        In the body's frame [m].
    quaternion : Array, shape (4,)
        Orientation in the body's frame, x y z w.
    rgba : Array, shape (4,)
        Colour, 0 to 1.
    vertices, faces : Array, shape (vertex, 3) [m] and (face, 3)
        Of a mesh, in its own frame; empty otherwise.
    """

    name: str
    body: str
    kind: Kind
    size: Array
    position: Array
    quaternion: Array
    rgba: Array
    vertices: Array
    faces: npt.NDArray[np.int32]


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
    """Return the visible shapes of the robot; planes and height fields are left out."""
    model, found = robot.model, []
    for g in range(model.ngeom):
        kind, geom, rgba = _KINDS.get(int(model.geom_type[g])), model.geom(g), _color(model, g)
        if kind is None or rgba[3] == 0 or model.geom_group[g] >= HIDDEN:
            continue
        body = body_name(model, int(model.geom_bodyid[g]))
        name = geom.name or f"geom{g}"
        mesh = _mesh(model, int(model.geom_dataid[g])) if kind == "mesh" else (np.empty((0, 3)), np.empty((0, 3), np.int32))
        found.append(Shape(name, body, kind, geom.size.copy(), geom.pos.copy(), _xyzw(geom.quat), rgba, *mesh))
    return found


def body_name(model: mujoco.MjModel, b: int) -> str:
    """Return the name of a body, or its number where it has none."""
    return model.body(b).name or f"body{b}"


def _color(model: mujoco.MjModel, g: int) -> Array:
    material = int(model.geom_matid[g])
    return (model.geom_rgba[g] if material < 0 else model.mat_rgba[material]).astype(np.float64)


def _mesh(model: mujoco.MjModel, m: int) -> tuple[Array, npt.NDArray[np.int32]]:
    first, face = int(model.mesh_vertadr[m]), int(model.mesh_faceadr[m])
    vertices = model.mesh_vert[first : first + int(model.mesh_vertnum[m])].astype(np.float64)
    return vertices, model.mesh_face[face : face + int(model.mesh_facenum[m])].copy()


def motion(robot: Robot, q: Array) -> Motion:
    """Return where the bodies and sites are at the positions `q` [rad], shape (time, joint)."""
    states, model = Batch(robot.model, len(q)), robot.model
    xpos, xquat, site_xpos = states.bind("xpos"), states.bind("xquat"), states.bind("site_xpos")
    states.bind("qpos")[:] = q
    states.forward(stage=mjtStage.mjSTAGE_POS.value)
    bodies = {body_name(model, b): b for b in range(1, model.nbody)}
    return Motion(
        {name: xpos[:, b].copy() for name, b in bodies.items()},
        {name: _xyzw(xquat[:, b]) for name, b in bodies.items()},
        {model.site(s).name or f"site{s}": site_xpos[:, s].copy() for s in range(model.nsite)},
    )


def _xyzw(wxyz: Array) -> Array:
    return np.roll(wxyz, -1, axis=-1)
