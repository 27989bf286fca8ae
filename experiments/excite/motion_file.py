"""A planned motion as CSV, for a robot's controller."""

from pathlib import Path

import numpy as np

from idbench.experiments.excite.excited import Excited

PARTS = "part: 0 the way from home to the start, 1 the motion, with its rest at both ends, 2 the way back"
"""What stands in the first line."""


def write_motion(found: Excited, path: Path) -> None:
    """Write time [s], part, positions [rad], velocities and accelerations of every joint, at the controller's frequency."""
    fs, joints = found.design.scenario.fs, found.design.robot_model.robot.joints
    part, motion = found.planned(fs)
    names = ["t", "part", *(f"{letters}_{joint}" for letters in ("q", "qd", "qdd") for joint in joints)]
    table = np.column_stack([np.arange(len(part)) / fs, part, motion.q, motion.qd, motion.qdd])
    formats = ["%.6f", "%d", *["%.9g"] * (3 * len(joints))]
    np.savetxt(path, table, delimiter=",", header=f"# {PARTS}\n{','.join(names)}", comments="", fmt=formats)
