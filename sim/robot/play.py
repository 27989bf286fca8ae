"""Backlash in a robot's description: a second joint behind each, that moves freely within the play."""

import mujoco

from idbench.sim.errors import RobotError
from idbench.sim.robot.motors import Array

HARD = (0.95, 0.999, 1e-4, 0.5, 2.0)
"""MuJoCo's solimp of the ends: hard from 0.1 mrad on."""

LOCKED = 1e-9
"""Play of a joint that has none [rad]."""


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
