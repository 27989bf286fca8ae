"""Loads of an arm's joints, from measured and from simulated motions of the others."""

import numpy as np
import pytest

from experiments.servo.loads import loads
from identify.files.servo_log import ServoColumns
from sim.robot.inverse_dynamics import inverse_dynamics
from sim.robot.mounting import PLAIN
from sim.robot.servos import links

ARM = "servo_arm"


@pytest.fixture
def motion():
    """Return the robot, times, and a motion of all its joints with its derivatives."""
    robot = links(ARM, PLAIN)
    t = np.arange(0, 4, 0.01)
    f = 1.0 + 0.3 * np.arange(robot.n)
    q = 0.4 * np.sin(np.outer(t, f))
    return robot, t, q, 0.4 * f * np.cos(np.outer(t, f)), -(f**2) * q


def torques(robot, t, q, angles):
    columns = ServoColumns(t, q, q, None, None, robot.joints)
    return np.stack([load.torque(q[:, j]) for j, load in enumerate(loads(robot, columns, angles))], axis=1), columns


def test_loads_with_simulated_motions_are_those_of_inverse_dynamics(motion):
    robot, t, q, qd, qdd = motion
    found, columns = torques(robot, t, q, dict(enumerate(q.T)))
    inertia = np.stack([load.inertia * np.ones(len(t)) for load in loads(robot, columns, dict(enumerate(q.T)))], axis=1)
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
    sharp, _ = torques(robot, t, still, {2: still[:, 2]})
    before, rest = (t > 1.9) & (t < 1.98), sharp[:100, 1].mean()
    assert np.abs(sharp[before, 1] - rest).max() < 1e-9
    assert np.abs(smooth[before, 1] - rest).max() > 1e-3
