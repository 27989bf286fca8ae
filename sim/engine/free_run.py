"""A robot driven by the torques of a log alone, from where the log is, again and again."""

import numpy as np

from idbench.identify.data.motion_log import MotionLog
from idbench.sim.engine.plant import Plant
from idbench.sim.engine.replay import mean_torques, physics_steps
from idbench.sim.errors import ScenarioError
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.scenario.scenario import Physics


def free_run(robot: Robot, log: MotionLog, qd: Array, length: float) -> tuple[Array, Array]:
    """Return logged and simulated positions of stretches of a log that follow each other, shape (stretch, time, joint).

    Each begins with the position and velocity of the log; nothing holds the robot to its motion.

    Parameters
    ----------
    robot : Robot
        To be simulated.
    log : MotionLog
        One run.
    qd : Array, shape (time, joint)
        Velocities of the log [rad/s].
    length : float
        Of a stretch [s].

    Raises
    ------
    ScenarioError
        If the log is shorter than a stretch.
    """
    samples = round(length * log.fs)
    count = log.samples // max(samples, 1)
    if samples < 1:
        raise ScenarioError(f"a stretch of {length:g} s has no sample at {log.fs:g} Hz: use a longer one")
    if count < 1:
        raise ScenarioError(f"a log of {log.samples / log.fs:.3g} s has no stretch of {length:g} s: use a shorter one")
    physics = Physics()
    h, per_sample = physics_steps(log.fs, physics.step)
    plant = Plant(robot, count, physics, h, {}, 1)
    torques = _cut(mean_torques(log, h, per_sample), count, samples)
    measured, speed = _cut(log.q, count, samples), _cut(qd, count, samples)
    plant.q[:], plant.qd[:] = measured[:, 0], speed[:, 0]
    simulated = np.empty(measured.shape)
    for k in range(samples):
        simulated[:, k] = plant.q
        plant.step(np.ascontiguousarray(np.swapaxes(torques[:, k], 0, 1)), per_sample)
    simulated[list(plant.troubles)] = np.nan
    return measured, simulated


def _cut(x: Array, count: int, samples: int) -> Array:
    return x[: count * samples].reshape(count, samples, *x.shape[1:])
