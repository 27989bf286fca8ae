"""Logs made uniform: jittered, slower and faster, they are identified as before."""

import pytest

from idbench.identify import MotionLog, PowerModel, TimeError, identify, scara
from idbench.identify.data.resample import resample
from idbench.sim.engine.simulation import simulate
from idbench.sim.scenario.scenario_file import load


@pytest.fixture(scope="module")
def held():
    return simulate(load("ideal")).alone()


@pytest.mark.thorough
@pytest.mark.parametrize("fs", [97.0, 100.0, 211.0])
def test_a_held_log_at_another_frequency_is_identified(fs, held, truth):
    """The mean of what was held: within 1 %, which is what means over a new period do to a staircase of the old one."""
    uniform = resample(held.t, held.q, held.tau, held.torque, fs)
    assert uniform.torque.meaning == "averaged"
    assert identify(uniform, scara(), PowerModel()).relative_error_percent(truth).max() < 1


def test_an_instantaneous_log_with_jittered_times_is_identified(log, table1, truth, rng):
    """Times scattered by 5 % of a step: refused as they are, and identified when they are made uniform."""
    t = log.t + rng.uniform(-0.025, 0.025, log.samples) / log.fs
    reference = table1.scenario.trajectory.points.at(t, log.fs)
    from idbench.sim.robot.inverse_dynamics import coulomb_torque, inverse_dynamics

    tau = inverse_dynamics(table1.robot, reference.q, reference.qd, reference.qdd) + coulomb_torque(table1.robot, reference.qd)
    with pytest.raises(TimeError, match="time is not uniform"):
        MotionLog.at_times(t, reference.q, tau, log.torque)
    uniform = resample(t, reference.q, tau, log.torque, 100.0)
    # Straight lines between torques err by (w T)^2/8 of what varies at w = 20 rad/s, 0.5 %, mostly of both signs.
    assert identify(uniform, scara(), PowerModel()).relative_error_percent(truth).max() < 3
