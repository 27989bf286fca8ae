"""Robots driven by the torques of a log: held to its motion by a weak loop, from where it is again and again, or from anywhere.

One loop: plants start somewhere in the log, get its torques as its channel says, and what a feedback adds.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from idbench.identify.data.motion_log import MotionLog
from idbench.identify.errors import InvariantError
from idbench.sim.drives import IdealDrive
from idbench.sim.engine.batched import BatchedPlant
from idbench.sim.engine.failures import Bounds
from idbench.sim.errors import RobotError
from idbench.sim.robot.inverse_dynamics import BLOCK, InverseDynamics
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.scenario.scenario import Physics
from idbench.sim.trajectories import Reference

STEP, SHORTEST = 0.002, 0.001
"""Longest physics step [s], by RK4 (positions of six held joints change by 3e-6 rad of 2e-4 when it is halved), and how short
one is for joints that friction stops in less."""

Feedback = Callable[[int, BatchedPlant], Array]
"""Torque beside that of the log at a sample [N m], shape (nsim, joint)."""


def replays(robots: Sequence[Robot], logs: Sequence[MotionLog], qd: Array, bandwidth: float) -> list[Array | str]:
    """Positions [rad] of robots under torques, shape (time, joint); of one that runs away, when and how.

    Those that are alike are one batch. The torques act as their log's channel says; the loop adds M (w^2 e + 2 w de/dt), M the
    diagonal of the inertia matrix. A robot with the parameters of the one that was logged needs no feedback, beside noise.

    Parameters
    ----------
    robots : sequence of Robot
        To be simulated: one robot with other parameters each.
    logs : sequence of MotionLog
        One run, with the torques that each of them gets: their positions and instants are the same.
    qd : Array, shape (time, joint)
        Velocities of the log [rad/s].
    bandwidth : float
        Natural frequency w of the loop [rad/s].
    """
    if len({(log.fs, log.samples) for log in logs}) > 1:
        raise InvariantError("logs of one run must have the same instants")
    groups, found = dict[Physics, list[int]](), dict[int, Array | str]()
    for k, (robot, log) in enumerate(zip(robots, logs, strict=True)):
        groups.setdefault(physics_of(robot, log), []).append(k)
    for group in groups.values():
        each = [robots[k] for k in group], [logs[k] for k in group]
        try:
            found |= dict(zip(group, _replayed(*each, qd, bandwidth), strict=True))
        except RobotError:  # which differ in more than parameters
            found |= {k: _replayed([robots[k]], [logs[k]], qd, bandwidth)[0] for k in group}
    return [found[k] for k in range(len(robots))]


def _replayed(robots: Sequence[Robot], logs: Sequence[MotionLog], qd: Array, bandwidth: float) -> list[Array | str]:
    log, nsim = logs[0], len(robots)
    reference = Reference(log.fs, log.q, qd, np.zeros_like(qd))
    kp = np.stack([_inertia(robot, log.q) for robot in robots], axis=1) * bandwidth**2
    failed = dict[int, str]()
    bounds = Bounds(robots[0], reference, nsim)

    def held(k: int, plant: BatchedPlant) -> Array:
        for sim, why in {**plant.troubles, **bounds.all_broken(plant.q, plant.qd)}.items():
            failed.setdefault(sim, f"a robot with these parameters does not follow the log: {why} after {k / log.fs:.3g} s")
            plant.put(log.q[k], sim)
        found: Array = kp[k] * (log.q[k] - plant.q + 2 / bandwidth * (qd[k] - plant.qd))
        return found

    started = _start(robots, logs, np.tile(log.q[0], (nsim, 1)), np.tile(qd[0], (nsim, 1)))
    q, _ = _driven(started, log.samples * np.arange(nsim), log.samples, held)
    return [failed.get(sim) or q[sim] for sim in range(nsim)]


def shoot(
    robot: Robot,
    vary: Mapping[str, npt.ArrayLike],
    states: tuple[Array, Array],
    log: MotionLog,
    first: npt.ArrayLike,
    count: int,
    disturbance: Array | None = None,
) -> Array:
    """Return the positions of robots that start somewhere in a log, shape (nsim, count, joint), NaN of those that run away.

    Parameters
    ----------
    vary : mapping of str to array_like
        Fields of MuJoCo's model with a value for each simulation, shape (nsim, ...).
    states : tuple of Array, shape (nsim, joint)
        Positions and velocities at their first sample [rad, rad/s].
    log : MotionLog
        One run; its torques act as its channel says.
    first : int array, shape (nsim,)
        First sample of each.
    count : int
        Number of samples, the first included.
    disturbance : Array, shape (nsim, count, joint), optional
        Torques beside those of the log [N m].
    """
    beside = None if disturbance is None else lambda k, _: disturbance[:, k]
    found, broken = _driven(_start([robot], [log], *states, vary, 0), np.asarray(first), count, beside)
    found[broken] = np.nan
    return found


def _start(
    robots: Sequence[Robot],
    logs: Sequence[MotionLog],
    q: Array,
    qd: Array,
    vary: Mapping[str, npt.ArrayLike] | None = None,
    threads: int = 1,
) -> tuple[BatchedPlant, Array]:
    """Return robots in states [rad, rad/s], and the torques of logs, one after another, in every physics step.

    The torques have the shape (step, time, joint).
    """
    log, physics = logs[0], physics_of(robots[0], logs[0])
    plant = BatchedPlant(robots[0], len(q), physics, physics.step, vary or {}, threads)
    plant.q[:], plant.qd[:] = q, qd
    if len(robots) > 1:
        plant.become(robots)
    per_sample, late = round(1 / log.fs / physics.step), physics.early * physics.step
    acting = [replace(one, torque=replace(one.torque, delay=one.torque.delay + late)) for one in logs]
    torques = np.concatenate([mean_torques(one, physics.step, per_sample) for one in acting])
    return plant, np.ascontiguousarray(torques.swapaxes(0, 1))


def physics_of(robot: Robot, log: MotionLog) -> Physics:
    """Integration of a robot that a log drives, in whole steps per sample.

    RK4 follows joints that viscous friction stops in M / Fv with as long a step, and becomes unstable where a step is 2.8 times
    as long: what stops in less than the shortest is integrated implicitly (to first order, and half a step early).
    """
    Fv = robot.model.dof_damping
    stopping = float(np.min(np.divide(_inertia(robot, log.q[:1])[0], Fv, out=np.full(robot.n, np.inf), where=Fv > 0)))
    h = IdealDrive().step_length(log.fs, float(np.clip(stopping, SHORTEST, STEP)))
    return Physics(h) if stopping > h * (1 - 1e-9) else Physics(h, "implicitfast")


def _driven(
    started: tuple[BatchedPlant, Array], first: npt.NDArray[np.intp], count: int, feedback: Feedback | None = None
) -> tuple[Array, list[int]]:
    """Return positions from some samples of a log on, shape (sim, count, joint), and the simulations that ran away."""
    plant, torques = started
    found = np.full((len(first), count, torques.shape[-1]), np.nan)
    for k in range(count):
        found[:, k] = plant.q
        acting = torques.take(first + k, axis=1)
        if feedback is not None:
            acting += feedback(k, plant)
        if k + 1 < count:
            plant.step(acting)
    return found, list(plant.troubles)


def mean_torques(log: MotionLog, h: float, per_sample: int) -> Array:
    """Return the mean of the torque that acts in every physics step, shape (time, step, joint)."""
    if lags := log.torque.lags:
        channels = (replace(log.torque, delay=log.torque.delay + lag, lags=()) for lag in lags)
        each = [mean_torques(replace(log, torque=channel), h, per_sample)[..., j] for j, channel in enumerate(channels)]
        return np.stack(each, axis=-1)
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
    parts = (q[i : i + BLOCK] for i in range(0, len(q), BLOCK))
    return np.concatenate([InverseDynamics(robot, len(part)).inertia(part) for part in parts])
