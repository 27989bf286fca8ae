"""Where a robot's torques go: the budget of a motion."""

from collections.abc import Mapping

import numpy as np

from idbench.identify import Array
from idbench.sim.robot.inverse_dynamics import coulomb_torque, inverse_dynamics
from idbench.sim.robot.robot import Robot
from idbench.sim.trajectories import Reference

ROUNDING = 1e-12  # Torques below this share of the total are rounding


def largest_torques(robot: Robot, motion: Reference) -> Mapping[str, Array]:
    """Return the largest torques along a motion: of every cause, of all together, and of the motor [N m], shape (joint,)."""
    still = np.zeros_like(motion.q)
    gravity = inverse_dynamics(robot, motion.q, still, still)
    damping = robot.model.dof_damping * motion.qd
    parts = {  # shape (time, joint)
        "gravity": gravity,
        "inertia": inverse_dynamics(robot, motion.q, still, motion.qdd) - gravity,
        "velocity": inverse_dynamics(robot, motion.q, motion.qd, still) - gravity - damping,
        "friction": damping + coulomb_torque(robot, motion.qd),
    }
    found = {name: np.abs(part).max(axis=0) for name, part in parts.items()}
    total = np.abs(np.sum(list(parts.values()), axis=0)).max(axis=0)
    found = {name: np.where(part > ROUNDING * total, part, 0.0) for name, part in found.items()}
    return {**found, "total": total, "limit": robot.torque_limits}
