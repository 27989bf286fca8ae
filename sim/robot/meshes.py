"""Meshes that are not where a file says: a robot moves without its looks."""

from pathlib import Path

import mujoco

from idbench.sim.robot.urdf import SIZE, SMALL


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
