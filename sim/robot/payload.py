"""A payload that the controller does not know."""

from math import pi
from pathlib import Path
from typing import Annotated

import mujoco
from pydantic import Field

from idbench.sim.errors import RobotError, ScenarioError
from idbench.sim.robot.motors import Array
from idbench.sim.robot.urdf import SIZE, SMALL
from idbench.sim.settings import NotNegative, Number, settings


def without_missing_meshes(spec: mujoco.MjSpec, folder: Path) -> list[str]:
    """Take shapes out whose meshes are not there; return what was done. Links that have their mass from them get some."""
    home = folder / (spec.meshdir or "")
    missing = {
        mesh.name or Path(mesh.file).stem: mesh for mesh in spec.meshes if mesh.file and not (home / mesh.file).is_file()
    }
    if not missing:
        return []
    notes = [
        f"meshes that are not there ({', '.join(list(missing)[:3])}{', ...' if len(missing) > 3 else ''}): it is not drawn"
    ]
    bare = []
    for geom in [geom for geom in spec.geoms if geom.meshname in missing]:
        body = geom.parent
        spec.delete(geom)
        if not body.explicitinertial and not list(body.geoms) and list(body.joints):
            body.mass = SMALL
            body.inertia = [SMALL * SIZE**2] * 3
            body.explicitinertial = True
            bare.append(body.name)
    for mesh in missing.values():
        spec.delete(mesh)
    return notes + ([f"no inertia of {', '.join(bare)} but that of its mesh: 1 g is taken"] if bare else [])


HARD = (0.95, 0.999, 1e-4, 0.5, 2.0)  # MuJoCo's solimp of the ends: hard from 0.1 mrad on
LOCKED = 1e-9  # Play of a joint that has none [rad]


def with_play(spec: mujoco.MjSpec, play: Array, h: float) -> None:
    """Give every joint free play [rad or m], shape (joint,): two joints at one place, the second with ends.

    The first keeps drive, armature and friction, the second has the link. `h` is the physics step [s].
    """
    if len({joint.parent.name for joint in spec.joints}) < len(spec.joints):
        raise RobotError("backlash needs a body for each joint; this robot has a body that moves in several joints")
    for joint, width in zip(list(spec.joints), play.tolist(), strict=True):
        half = max(width, LOCKED) / 2
        gap = joint.parent.add_joint(name=f"{joint.name}_play", type=joint.type, axis=joint.axis, pos=joint.pos)
        gap.range, gap.limited = [-half, half], mujoco.mjtLimited.mjLIMITED_TRUE
        gap.armature = gap.frictionloss = gap.margin = 0.0
        gap.damping, gap.stiffness = [0.0] * len(gap.damping), [0.0] * len(gap.stiffness)
        gap.solref_limit, gap.solimp_limit = [2 * h, 1.0], list(HARD)


@settings
class Payload:
    """A mass bolted to the last link. It is part of the truth, and unknown to the controller."""

    mass: Annotated[Number, Field(ge=0, le=1e5)] = 0.0
    """[kg]; 0 for no payload."""
    position: tuple[Number, Number, Number] = (0.3, 0.0, 0.0)
    """Centre of mass in the frame of the last link [m]."""
    inertia: NotNegative = 0.0
    """Moment of inertia about each axis through its centre of mass [kg m^2]; 0 for that of a steel ball of this mass."""

    def edit(self, spec: mujoco.MjSpec) -> None:
        """Bolt it to the body that the robot's last joint moves."""
        if not self.mass:
            if self.inertia:
                raise ScenarioError(f"payload.inertia = {self.inertia:g} kg m^2 needs a payload.mass above 0")
            return
        body = spec.joints[-1].parent.add_body(name="payload", pos=list(self.position))
        body.mass = self.mass
        radius = (3 * self.mass / (4 * pi * 7850)) ** (1 / 3)  # of a ball of 7850 kg/m^3, whose inertia is 2/5 m r^2
        body.inertia = [self.inertia or 0.4 * self.mass * radius**2] * 3
        body.ipos = [0, 0, 0]
        body.explicitinertial = True
