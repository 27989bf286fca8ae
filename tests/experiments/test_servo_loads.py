"""Loads of an arm's joints, from measured and from simulated motions of the others."""

import numpy as np
import pytest

from idbench.experiments.servo.joints import Moving, loads
from idbench.identify.files.servo_log import ServoColumns
from idbench.sim.robot.inverse_dynamics import inverse_dynamics
from idbench.sim.robot.mounting import PLAIN
from idbench.sim.robot.servos import links

ARM = "servo_arm"


@pytest.fixture
def motion():
    """Return the robot, times, and a motion of all its joints with its derivatives."""
    robot = links(ARM, PLAIN)
    t = np.arange(0, 4, 0.01)
    f = 1.0 + 0.3 * np.arange(robot.n)
    q = 0.4 * np.sin(np.outer(t, f))
    return robot, t, q, 0.4 * f * np.cos(np.outer(t, f)), -(f**2) * q


def exact(t, q):
    """Return all joints as simulated exactly."""
    return {j: Moving(t, x, 0.0) for j, x in enumerate(q.T)}


def torques(robot, t, q, moving):
    columns = ServoColumns(t, q, q, None, None, robot.joints)
    return np.stack([load.torque(t, q[:, j]) for j, load in enumerate(loads(robot, columns, moving))], axis=1), columns


def test_loads_with_simulated_motions_are_those_of_inverse_dynamics(motion):
    robot, t, q, qd, qdd = motion
    found, columns = torques(robot, t, q, exact(t, q))
    inertia = np.stack([load.over(t)[0] for load in loads(robot, columns, exact(t, q))], axis=1)
    expected = inverse_dynamics(robot, q, qd, qdd)
    inside = slice(5, -5)
    size = np.abs(expected).max(axis=0)
    # Differences over T: (2 pi f T)^2 / 12 of accelerations, a tenth of a per cent at the fastest joint.
    assert (np.abs(found + inertia * qdd - expected)[inside].max(axis=0) < 2e-3 * size).all()


def test_simulated_motions_have_jumps_that_smoothed_ones_lack(motion):
    """A joint that starts with a jolt pushes the others at that instant, not before."""
    robot, t, q, _, _ = motion
    still = np.zeros_like(q)
    still[:, 2] = np.where(t > 2, 10.0 * (t - 2) ** 2, 0.0) * (t < 2.3) + (t >= 2.3) * 0.9
    smooth, _ = torques(robot, t, still, {})
    sharp, _ = torques(robot, t, still, {2: Moving(t, still[:, 2], 0.0)})
    before, rest = (t > 1.9) & (t < 1.98), sharp[:100, 1].mean()
    assert np.abs(sharp[before, 1] - rest).max() < 1e-9
    assert np.abs(smooth[before, 1] - rest).max() > 1e-3


def test_a_simulation_that_drifts_away_is_brought_back_to_what_was_measured(motion):
    robot, t, q, _, _ = motion
    right, _ = torques(robot, t, q, exact(t, q))
    drifts = exact(t, q) | {2: Moving(t, q[:, 2] + 0.1 * t, 0.0)}
    found, _ = torques(robot, t, q, drifts)
    inside, lost = slice(50, -50), np.ptp(right[:, 1])
    assert np.abs(found - right)[inside].max() < 1e-3 * lost  # 0.4 rad of drift would be a good part of gravity


def test_angles_of_the_file_are_those_of_the_log_plus_the_offset(motion):
    robot, t, q, _, _ = motion
    right, _ = torques(robot, t, q, exact(t, q))
    moved, offset = q.copy(), np.array([0.0, 0.0, 0.2, 0.0, 0.0, 0.0])
    moved -= offset
    found, _ = torques(robot, t, moved, {j: Moving(t, x, offset[j]) for j, x in enumerate(moved.T)})
    others = [j for j in range(robot.n) if j != 2]  # the joint itself has its offset in the law of its servo
    np.testing.assert_allclose(found[:, others], right[:, others], atol=1e-9 * np.abs(right).max())


def test_spikes_of_one_joint_load_no_other(motion):
    robot, t, q, _, _ = motion
    spoilt = q.copy()
    spoilt[200, 2] = -np.pi
    for moving in ({}, exact(t, q)):
        right, _ = torques(robot, t, q, moving)
        columns = ServoColumns(t, spoilt, spoilt, None, None, robot.joints)
        found = np.stack([load.torque(t, q[:, j]) for j, load in enumerate(loads(robot, columns, moving))], axis=1)
        assert np.abs(found - right).max() < 0.01 * np.abs(right).max()
