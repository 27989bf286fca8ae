"""Robots driven by the torques of a log, from states of their own."""

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from idbench.identify.data.motion_log import MotionLog
from idbench.sim.engine.plant import Plant
from idbench.sim.engine.replay import mean_torques, physics_steps
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.scenario.scenario import Physics

STEP = 0.002
"""Longest physics step [s]: of half a second nothing is lost by it."""


def shoot(
    robot: Robot, vary: Mapping[str, npt.ArrayLike], q: Array, qd: Array, log: MotionLog, first: npt.ArrayLike, count: int
) -> Array:
    """Return the positions of robots that start somewhere in a log, shape (nsim, count, joint), NaN of those that run away.

    Parameters
    ----------
    robot : Robot
        The robot.
    vary : mapping of str to array_like
        Fields of MuJoCo's model with a value for each simulation, shape (nsim, ...).
    q, qd : Array, shape (nsim, joint)
        States at their first sample [rad, rad/s].
    log : MotionLog
        One run; its torques act as its channel says.
    first : int array, shape (nsim,)
        First sample of each.
    count : int
        Number of samples, the first included.
    """
    start, nsim = np.asarray(first), len(q)
    physics = Physics(step=STEP)
    h, per_sample = physics_steps(log.fs, physics.step)
    plant = Plant(robot, nsim, physics, h, vary, 0)
    plant.q[:], plant.qd[:] = q, qd
    torques = mean_torques(log, h, per_sample)
    found = np.full((nsim, count, robot.n), np.nan)
    for k in range(count):
        found[:, k] = plant.q
        if k + 1 < count:
            plant.step(np.swapaxes(torques[start + k], 0, 1), per_sample)
    for sim in plant.troubles:
        found[sim] = np.nan
    return found
