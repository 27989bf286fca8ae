"""The delay of a torque, from the log alone: known delays of simulated loops, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from idbench.identify import (
    ExcitationError,
    LogError,
    MotionLog,
    SettingError,
    TorqueChannel,
    idbench_chain,
    paper_chain,
    scara,
)
from idbench.identify.judge.delay import estimate_delay
from idbench.sim.drives import AveragedDrive
from idbench.sim.encoders import IncrementalEncoder
from idbench.sim.engine.simulation import simulate
from idbench.sim.scenario.measurement import TorqueMeasurement
from idbench.sim.scenario.scenario import Timing
from idbench.sim.scenario.scenario_file import load
from idbench.sim.trajectories import RandomMoves

SIXTEEN = IncrementalEncoder(lines=2**14)


def without_delay(run):
    log = run.alone()
    return MotionLog(log.fs, log.q, log.tau, TorqueChannel("held"))


@pytest.mark.thorough
@pytest.mark.parametrize("delay", [0.0, 0.0017, 0.0083, 0.015])
@pytest.mark.parametrize("seed", [None, 1])
def test_a_known_delay_is_found_with_16_bits(delay, seed):
    """Within 0.05 ms, a quarter of what is asked for, and within five of its own sigma."""
    scenario = load("ideal")
    if seed is not None:
        scenario = replace(scenario, trajectory=RandomMoves(seed=seed))
    found = estimate_delay(without_delay(simulate(replace(scenario, encoder=SIXTEEN, timing=Timing(delay=delay)))), scara())
    assert abs(found.delay - delay) < 5e-5
    assert abs(found.delay - delay) < 5 * found.sigma
    assert found.sigma < 5e-5


@pytest.mark.thorough
def test_its_sigma_is_its_scatter():
    """Twelve realizations of torque noise: the jackknife says the scatter, known to a fifth, to a factor of two."""
    noisy = replace(load("ideal"), torque=TorqueMeasurement(noise=(0.5, 0.05)))
    run = simulate(noisy, range(12))
    logs = [MotionLog(100.0, run.log.q[i], run.log.tau[i], TorqueChannel("held")) for i in range(12)]
    found = [estimate_delay(log, scara()) for log in logs]
    scatter = np.std([one.delay for one in found], ddof=1)
    assert 0.5 < np.mean([one.sigma for one in found]) / scatter < 2


@pytest.mark.thorough
def test_the_lag_of_a_current_loop_is_found_as_well():
    run = simulate(replace(load("ideal"), drive=AveragedDrive(bandwidth=200.0), timing=Timing(delay=0.003)))
    assert estimate_delay(without_delay(run), scara()).delay == pytest.approx(0.003 + 1 / (2 * np.pi * 200), abs=5e-5)


def test_several_logs_have_one_delay(log):
    late = MotionLog(log.fs, log.q[:-1], log.tau[1:], log.torque)  # the torque of the next instant: late by -10 ms
    assert estimate_delay([late, late], scara()).delay == pytest.approx(0.01, abs=1e-5)


def test_what_cannot_be_estimated_is_told(log):
    with pytest.raises(SettingError, match=r"the range of delays, 0\.01 to 0 s, is empty"):
        estimate_delay(log, scara(), within=(0.01, 0.0))
    with pytest.raises(SettingError, match="fits best at an end of the range"):
        estimate_delay(log, scara(), within=(0.01, 0.03))
    with pytest.raises(SettingError, match="a chain that takes torques as logged does not read it"):
        estimate_delay(log, scara(), replace(idbench_chain(), alignment=paper_chain().alignment))
    with pytest.raises(LogError, match="give the runs one by one"):
        estimate_delay(MotionLog(log.fs, log.q[None], log.tau[None], log.torque), scara())
    still = MotionLog(log.fs, np.full_like(log.q, 0.5), log.tau, log.torque)
    with pytest.raises((ExcitationError, ValueError)):
        estimate_delay(still, scara())
