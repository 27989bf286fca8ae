"""What a control loop commands against the ripple of its drives."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from idbench.sim.controllers import Task
from idbench.sim.engine.run import Run
from idbench.sim.robot.inverse_dynamics import InverseDynamics
from idbench.sim.robot.motors import Array

NOTHING = 1e-6  # Share of the logged torque below which what drives add is rounding


@dataclass(frozen=True, eq=False)
class Rejection:
    """The torques that drives add to what is commanded, and what the loop commands against them."""

    ripple: Array
    """True torque minus the commanded one [N m], shape (time, joint)."""
    rejected: Array
    """Torque that the loop commands because of it [N m], shape (time, joint)."""
    logged: Array
    """Rms of the logged torque about its mean [N m], shape (joint,)."""

    def words(self, joints: Sequence[str], wdyn: float | None) -> str:
        """Share of rejection in each joint's logged torque, in a line."""
        rms, of = self.rejected.std(axis=0), self.ripple.std(axis=0)
        each = [
            f"{name} {r:.2g} of {x:.2g} N m, {100 * r / y:.2g} % of the logged torque"
            for name, r, x, y in zip(joints, rms, of, self.logged, strict=True)
        ]
        loop = "" if wdyn is None else f", wdyn {wdyn:.3g} Hz"
        return f"ripple rejected by the loop (rms{loop}): {', '.join(each)}"


def rejection(run: Run, i: int = 0) -> Rejection | None:
    """Torques that the loop of a simulation rejects; None if its drives add nothing, or if it commands no torques.

    Were there no ripple d, positions would differ by delta and commands by v: with the law u(k, q) of the controller,

        v = u(k, q) - u(k, q - delta),   M(q) s^2 delta = v + d - Fv s delta,

    about the motion as it was. Coulomb friction, whose sign stays, has no part in it; nor have delays of the drive.
    """
    scenario, robot = run.scenario, run.robots[i]
    h = 1 / scenario.fs
    d, logged = run.tau[i] - run.command[i], run.log.tau[i].std(axis=0)
    if scenario.controller.commanded != "torque" or not (d.std(axis=0) > NOTHING * logged).any():
        return None
    q, still = run.q[i], np.zeros_like(run.q[i])
    at = InverseDynamics(robot, len(q))
    at(q, still, still)
    inverse, damping = np.linalg.inv(at.mass_matrix), robot.model.dof_damping
    law, other = (scenario.controller.start(Task(scenario.nominal_robot, run.reference, 1)) for _ in range(2))
    delta, rate = np.zeros((2, robot.n))
    found = np.zeros_like(d)
    for k in range(len(q)):
        found[k] = law.command(k, q[k : k + 1])[0] - other.command(k, q[k : k + 1] - delta)[0]
        acceleration = (inverse[k] * (found[k] + d[k] - damping * rate)).sum(axis=-1)
        delta = delta + rate * h + acceleration * h**2 / 2
        rate = rate + acceleration * h
    return Rejection(d, found, logged)
