"""Robots driven by logged torques alone."""

from dataclasses import replace

import numpy as np
import pytest

from idbench.sim.engine.driven import free_run
from idbench.sim.engine.simulation import simulate
from idbench.sim.errors import ScenarioError
from idbench.sim.robot.robot import Robot
from idbench.sim.scenario.scenario_file import load
from idbench.sim.trajectories import RandomMoves


@pytest.fixture(scope="module")
def log():
    scenario = load("ideal")
    return simulate(replace(scenario, trajectory=RandomMoves(moves=4, durations=(0.8, 1.2), rest=0.2))).alone()


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


@pytest.mark.parametrize("length", [1e-5, 1e3])
def test_stretches_that_a_log_does_not_have_are_refused(log, length):
    with pytest.raises(ScenarioError, match="stretch"):
        free_run(Robot.load("scara"), log, np.zeros_like(log.q), length)
