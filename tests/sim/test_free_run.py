"""Robots driven by logged torques: alone, or held to the log by a weak loop."""

from dataclasses import replace

import numpy as np
import pytest

from idbench.identify.errors import InvariantError
from idbench.sim.engine.batched import BatchedPlant
from idbench.sim.engine.driven import physics_of, replays, shoot
from idbench.sim.engine.simulation import simulate
from idbench.sim.errors import RobotError
from idbench.sim.robot.robot import Robot
from idbench.sim.scenario.scenario import Physics
from idbench.sim.scenario.scenario_file import load
from idbench.sim.trajectories import RandomMoves


@pytest.fixture(scope="module")
def log():
    scenario = load("ideal")
    return simulate(replace(scenario, trajectory=RandomMoves(moves=4, durations=(0.8, 1.2), rest=0.2))).alone()


def free_run(robot, log, qd, length):
    """Return logged and simulated positions of stretches of a log that follow each other, shape (stretch, time, joint)."""
    samples = round(length * log.fs)
    first = samples * np.arange(log.samples // samples)
    return log.q[first[:, None] + np.arange(samples)], shoot(robot, {}, (log.q[first], qd[first]), log, first, samples)


def test_the_robot_that_was_logged_follows_its_own_torques(log):
    qd = np.gradient(log.q, 1 / log.fs, axis=0)
    measured, simulated = free_run(Robot.load("scara"), log, qd, 0.5)
    assert measured.shape == simulated.shape == (int(log.samples / log.fs / 0.5), round(0.5 * log.fs), 2)
    np.testing.assert_array_equal(measured.reshape(-1, 2), log.q[: measured.shape[0] * measured.shape[1]])
    np.testing.assert_array_equal(simulated[:, 0], measured[:, 0])
    moved = np.ptp(log.q, axis=0)
    assert (np.sqrt(((measured - simulated) ** 2).mean(axis=(0, 1))) < 0.01 * moved).all()


def test_another_robot_does_not(log):
    qd = np.gradient(log.q, 1 / log.fs, axis=0)
    robot = Robot.load("scara")
    robot.model.dof_damping[:] += 5.0
    measured, simulated = free_run(robot, log, qd, 0.5)
    assert (np.sqrt(((measured - simulated) ** 2).mean(axis=(0, 1))) > 0.02 * np.ptp(log.q, axis=0)).any()


def changed(**fields):
    robot = Robot.load("scara")
    for name, values in fields.items():
        getattr(robot.model, name)[:] = values
    return robot


def test_replays_of_a_batch_are_those_of_each_robot(log):
    qd = np.gradient(log.q, 1 / log.fs, axis=0)
    stiff = changed(dof_damping=[0.0, 200.0])
    robots = [Robot.load("scara"), changed(dof_damping=0.3), changed(dof_frictionloss=0.0), stiff]
    logs = [log, log, replace(log, tau=0.9 * log.tau), log]
    together = replays(robots, logs, qd, 5.0)
    for robot, own, found in zip(robots, logs, together, strict=True):
        (alone,) = replays([robot], [own], qd, 5.0)
        np.testing.assert_allclose(found, alone, rtol=0, atol=1e-12)
    assert np.abs(together[0] - log.q).max() < np.abs(together[2] - log.q).max()


def test_a_robot_that_runs_away_leaves_the_others(log):
    qd = np.gradient(log.q, 1 / log.fs, axis=0)
    good, none = replays([Robot.load("scara")] * 2, [log, replace(log, tau=log.tau + 1e3)], qd, 5.0)
    assert np.isfinite(good).all()
    assert "does not follow the log: joint joint2 runs away" in none
    (same,) = replays([Robot.load("scara")], [log], qd, 5.0)
    np.testing.assert_allclose(good, same, rtol=0, atol=1e-12)


def test_logs_of_other_instants_are_refused_and_other_bodies_are_simulated_alone(log):
    qd = np.gradient(log.q, 1 / log.fs, axis=0)
    with pytest.raises(InvariantError, match="same instants"):
        replays([Robot.load("scara")] * 2, [log, log.part(0, 100)], qd, 5.0)
    with pytest.raises(RobotError, match="more than parameters"):
        BatchedPlant(Robot.load("scara"), 2, Physics(), 1e-3, {}, 1).become([Robot.load("scara"), Robot.load("two_link")])
    one, other = replays([Robot.load("scara"), Robot.load("two_link")], [log] * 2, qd, 5.0)
    np.testing.assert_array_equal(one, replays([Robot.load("scara")], [log], qd, 5.0)[0])
    assert isinstance(other, str) or not np.array_equal(other, one)


def test_steps_are_as_short_as_friction_asks_and_stiff_joints_stay_stable(log):
    slow, quick = (physics_of(changed(dof_damping=Fv), log) for Fv in (0.0, 1e4))
    assert (slow.step, slow.integrator) == (0.002, "RK4")
    assert (quick.step, quick.integrator) == (0.001, "implicitfast")
    middle = physics_of(changed(dof_damping=[0.0, 0.06 / 0.0015]), log)  # ZZ2 = 0.06 kg m^2 of the second joint
    assert 0.0014 < middle.step < 0.0015  # in whole steps a sample
    assert middle.integrator == "RK4"
    fine = replace(log, fs=4000.0)
    assert physics_of(changed(dof_damping=[0.0, 0.06 / 0.0005]), fine) == Physics(1 / 4000)  # samples are short enough
    (held,) = replays([changed(dof_damping=1e4)], [log], np.gradient(log.q, 1 / log.fs, axis=0), 5.0)
    assert np.isfinite(held).all()
