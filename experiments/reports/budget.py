"""Where a robot's torques go: the budget of a motion."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from idbench.identify import Array
from idbench.sim.robot.inverse_dynamics import coulomb_torque, inverse_dynamics
from idbench.sim.robot.robot import Robot
from idbench.sim.trajectories import Reference

ROUNDING = 1e-12  # Torques below this share of the total are rounding


@dataclass(frozen=True, eq=False)
class Budget:
    """The largest torques that each cause asks of the joints along a motion."""

    robot: Robot
    """The robot as its file describes it."""
    motion: Reference
    """Where it goes."""

    @cached_property
    def parts(self) -> Mapping[str, Array]:
        """Torques [N m] by their cause, shape (time, joint)."""
        q = self.motion.q
        qd = self.motion.qd
        qdd = self.motion.qdd
        still = np.zeros_like(q)
        gravity = inverse_dynamics(self.robot, q, still, still)
        damping = self.robot.model.dof_damping * qd
        return {
            "gravity": gravity,
            "inertia": inverse_dynamics(self.robot, q, still, qdd) - gravity,
            "velocity": inverse_dynamics(self.robot, q, qd, still) - gravity - damping,
            "friction": damping + coulomb_torque(self.robot, qd),
        }

    @cached_property
    def largest(self) -> Mapping[str, Array]:
        """Largest torque of every cause, of all together, and of the motor [N m], shape (joint,)."""
        found = {name: np.abs(part).max(axis=0) for name, part in self.parts.items()}
        total = np.abs(np.sum(list(self.parts.values()), axis=0)).max(axis=0)
        found = {name: np.where(part > ROUNDING * total, part, 0.0) for name, part in found.items()}
        return {**found, "total": total, "limit": self.robot.torque_limits}
