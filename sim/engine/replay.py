"""A robot driven by the torques of a log, held to its motion by a weak loop."""

from dataclasses import dataclass
from typing import final

import numpy as np

from idbench.identify.data.motion_log import MotionLog
from idbench.sim.engine.failures import Bounds
from idbench.sim.engine.plant import Plant
from idbench.sim.errors import ScenarioError
from idbench.sim.robot.inverse_dynamics import BLOCK, InverseDynamics
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.scenario.scenario import Physics
from idbench.sim.trajectories import Reference


@final
@dataclass(frozen=True, eq=False)
class Replay:
    """What a simulated robot does with the torques of a log."""

    q: Array
    """Its positions [rad], shape (time, joint)."""
    feedback: Array
    """What the loop adds to the torques of the log to hold it to the log's motion [N m], shape (time, joint)."""


def replay(robot: Robot, log: MotionLog, qd: Array, bandwidth: float) -> Replay:
    """Return what `robot` does with the torques of a log.

    The torques act as the log's channel says; the loop adds M (w^2 e + 2 w de/dt), M the diagonal of the inertia matrix. A
    robot with the parameters of the one that was logged needs no feedback, beside noise.

    Parameters
    ----------
    robot : Robot
        To be simulated.
    log : MotionLog
        One run.
    qd : Array, shape (time, joint)
        Velocities of the log [rad/s].
    bandwidth : float
        Natural frequency w of the loop [rad/s].

    Raises
    ------
    ScenarioError
        If it runs away.
    """
    physics = Physics()
    h, per_sample = physics_steps(log.fs, physics.step)
    plant = Plant(robot, 1, physics, h, {}, 1)
    plant.q[:], plant.qd[:] = log.q[0], qd[0]
    torques = mean_torques(log, h, per_sample)
    kp = _inertia(robot, log.q) * bandwidth**2
    q, feedback = np.empty(log.q.shape), np.empty(log.q.shape)
    bounds = Bounds(robot, Reference(log.fs, log.q, qd, np.zeros_like(qd)), 1)
    for k in range(log.samples):
        if broken := {**plant.troubles, **bounds.broken(plant.q, plant.qd)}:
            raise ScenarioError(f"a robot with these parameters does not follow the log: {broken[0]} after {k / log.fs:.3g} s")
        q[k] = plant.q[0]
        feedback[k] = kp[k] * (log.q[k] - q[k] + 2 / bandwidth * (qd[k] - plant.qd[0]))
        plant.step((torques[k] + feedback[k])[:, None, :], per_sample)
    return Replay(q, feedback)


def physics_steps(fs: float, longest: float) -> tuple[float, int]:
    """Return the length of physics steps of at most `longest` [s], and how many a sample takes."""
    per_sample = int(np.ceil(1 / fs / longest - 1e-9))
    return 1 / fs / per_sample, per_sample


def mean_torques(log: MotionLog, h: float, per_sample: int) -> Array:
    """Return the mean of the torque that acts in every physics step, shape (time, step, joint)."""
    tau = log.tau * np.asarray(log.torque.gain)
    T = 1 / log.fs
    delay = log.torque.delay
    edges = np.arange(log.samples * per_sample + 1) * h
    if log.torque.meaning == "instantaneous":
        at = log.t + delay
        values = np.stack([np.interp(edges, at, x) for x in tau.T], axis=-1)
        means = (values[1:] + values[:-1]) / 2
    else:
        starts = np.arange(log.samples + 1) * T + delay
        impulse = np.concatenate([np.zeros((1, log.n)), np.cumsum(tau, axis=0) * T])
        before, after = np.minimum(edges - starts[0], 0.0), np.maximum(edges - starts[-1], 0.0)
        grown = np.stack([np.interp(edges, starts, x) for x in impulse.T], axis=-1)
        grown += before[:, None] * tau[0] + after[:, None] * tau[-1]
        means = np.diff(grown, axis=0) / h
    return means.reshape(log.samples, per_sample, log.n)


def _inertia(robot: Robot, q: Array) -> Array:
    """Return the diagonal of M at every sample, shape (time, joint)."""
    found = np.empty(q.shape)
    for i in range(0, len(q), BLOCK):
        part = q[i : i + BLOCK]
        states = InverseDynamics(robot, len(part))
        states(part, np.zeros_like(part), np.zeros_like(part))
        found[i : i + BLOCK] = states.inertia()
    return found
