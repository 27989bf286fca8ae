"""What a robot looks like: shapes on moving bodies, for any viewer."""

from dataclasses import dataclass
from typing import Literal, get_args

import mujoco
import numpy as np
import numpy.typing as npt
from mujoco import mjtStage
from mujoco.batch import Batch

from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot

Kind = Literal["sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh"]

_KINDS: dict[int, Kind] = {int(getattr(mujoco.mjtGeom, f"mjGEOM_{kind.upper()}")): kind for kind in get_args(Kind)}

HIDDEN = 3  # Geoms of this group and higher are not drawn, as in MuJoCo's own viewer: they are there for collisions


@dataclass(frozen=True, eq=False)
class SceneShape:
    """One geom."""

    name: str
    """Its name."""
    body: str
    """The body that carries it."""
    kind: Kind
    """Sphere, capsule, ellipsoid, cylinder, box or mesh; capsules and cylinders along z, all but meshes centred."""
    size: Array
    """MuJoCo's sizes [m]: radius; radius and half length; half lengths, shape (3,)."""
    position: Array
    """In the body's frame [m], shape (3,)."""
    quaternion: Array
    """Orientation in the body's frame, x y z w, shape (4,)."""
    rgba: Array
    """Colour, 0 to 1, shape (4,)."""
    vertices: Array
    """Of a mesh, in its own frame [m], shape (vertex, 3); empty otherwise."""
    faces: npt.NDArray[np.int32]
    """Of a mesh, by the numbers of its vertices, shape (face, 3); empty otherwise."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Poses in the world."""

    positions: dict[str, Array]
    """Of every body, by name: (time, 3) [m]."""
    quaternions: dict[str, Array]
    """Of every body, by name: (time, 4), x y z w."""
    sites: dict[str, Array]
    """Positions of every site, by name: (time, 3) [m]."""


def shapes(robot: Robot) -> list[SceneShape]:
    """Return the visible shapes of the robot; planes and height fields are left out."""
    model, found = robot.model, []
    for g in range(model.ngeom):
        kind = _KINDS.get(int(model.geom_type[g]))
        geom = model.geom(g)
        material = int(model.geom_matid[g])
        rgba = (model.geom_rgba[g] if material < 0 else model.mat_rgba[material]).astype(np.float64)
        if kind is None or rgba[3] == 0 or model.geom_group[g] >= HIDDEN:
            continue
        body = body_name(model, int(model.geom_bodyid[g]))
        name = geom.name or f"geom{g}"
        mesh = _mesh(model, int(model.geom_dataid[g])) if kind == "mesh" else (np.empty((0, 3)), np.empty((0, 3), np.int32))
        found.append(SceneShape(name, body, kind, geom.size.copy(), geom.pos.copy(), _xyzw(geom.quat), rgba, *mesh))
    return found


def body_name(model: mujoco.MjModel, b: int) -> str:
    """Return the name of a body, or its number where it has none."""
    return model.body(b).name or f"body{b}"


def _mesh(model: mujoco.MjModel, m: int) -> tuple[Array, npt.NDArray[np.int32]]:
    first, face = int(model.mesh_vertadr[m]), int(model.mesh_faceadr[m])
    vertices = model.mesh_vert[first : first + int(model.mesh_vertnum[m])].astype(np.float64)
    return vertices, model.mesh_face[face : face + int(model.mesh_facenum[m])].copy()


class Mover:
    """Moves the bodies of a robot; for the next motion of as many instants it is ready."""

    def __init__(self, robot: Robot) -> None:
        self._model, self._size = robot.model, -1
        self._states: Batch | None = None
        self._bodies = {body_name(robot.model, b): b for b in range(1, robot.model.nbody)}
        self._sites = {robot.model.site(s).name or f"site{s}": s for s in range(robot.model.nsite)}

    def at(self, q: Array) -> Motion:
        """Poses of the bodies and sites at the positions `q` [rad], shape (time, joint)."""
        if self._states is None or len(q) != self._size:
            self._states, self._size = Batch(self._model, len(q)), len(q)
            names = ("qpos", "xpos", "xquat", "site_xpos")
            self._qpos, self._xpos, self._xquat, self._site_xpos = (self._states.bind(name) for name in names)
        self._qpos[:] = q
        self._states.forward(stage=mjtStage.mjSTAGE_POS.value)
        return Motion(
            {name: self._xpos[:, b].copy() for name, b in self._bodies.items()},
            {name: _xyzw(self._xquat[:, b]) for name, b in self._bodies.items()},
            {name: self._site_xpos[:, s].copy() for name, s in self._sites.items()},
        )


def _xyzw(wxyz: Array) -> Array:
    return np.roll(wxyz, -1, axis=-1)
