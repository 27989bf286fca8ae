"""The delay of a torque, from the log alone: known delays of simulated loops, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from builders import noisy

from idbench.identify import (
    ESTIMATORS,
    MODELS,
    ExcitationError,
    LogError,
    MotionLog,
    Problem,
    SettingError,
    TorqueChannel,
    estimate,
    idbench_chain,
    identify,
    scara,
)
from idbench.identify.files.log_file import read_log, write_log
from idbench.identify.judge.delay import estimate_delay, estimate_joint_delays
from idbench.identify.signals.filters import shift
from idbench.sim.drives import AveragedDrive
from idbench.sim.encoders import IncrementalEncoder
from idbench.sim.engine.driven import mean_torques
from idbench.sim.engine.simulation import simulate
from idbench.sim.scenario.measurement import TorqueMeasurement
from idbench.sim.scenario.scenario import Timing
from idbench.sim.scenario.scenario_file import load
from idbench.sim.trajectories import RandomMoves

SIXTEEN = IncrementalEncoder(lines=2**14)


def without_delay(run):
    log = run.alone()
    return MotionLog(log.fs, log.q, log.tau, TorqueChannel("held"))


def test_joints_that_answer_one_after_the_other_have_a_delay_each(truth):
    """Torques 2 ms later and 2 ms earlier, beside noise: found within 4 sigma, and the parameters with them.

    One delay for both leaves Fv1 more than 6 sigma off. ML and joined logs read the lags, too.
    """
    run = simulate(replace(load("ideal"), encoder=SIXTEEN, timing=Timing(delay=0.003), trajectory=RandomMoves(seed=1)))
    log = run.alone()
    noise = [0.5, 0.025] * np.random.default_rng(1).standard_normal(log.tau.shape)
    tau = np.stack([shift(x, lag * log.fs) for x, lag in zip((log.tau + noise).T, (0.002, -0.002), strict=True)], axis=1)
    mixed = MotionLog(log.fs, log.q, tau, TorqueChannel("held")).part(10, log.samples - 10)
    one, each = estimate_delay(mixed, scara()), estimate_joint_delays(mixed, scara())
    off = each.delay + np.array(each.lags) - [0.005, 0.001]
    assert (np.abs(off) < 4 * np.array(each.sigma)).all()
    assert max(each.sigma) < 4e-4

    def z(found, acronym):
        delayed = replace(mixed, torque=found.of(mixed.torque))
        made = Problem((delayed,), scara(), MODELS.create("explicit"), idbench_chain())
        estimated = estimate(made, ESTIMATORS.create(acronym))
        return (estimated.X - truth) / estimated.standard_errors

    assert abs(z(one, "GLS")[1]) > 6
    for acronym in ("GLS", "ML"):
        assert np.abs(z(each, acronym)).max() < 3.5, acronym


def test_lags_are_kept_by_files_and_must_be_of_the_joints(tmp_path):
    channel = TorqueChannel("held", 0.002, delay_sigma=(1e-4, 2e-4), lags=(0.001, -0.001))
    rng = np.random.default_rng(0)
    log = MotionLog(100.0, rng.standard_normal((50, 2)), rng.standard_normal((50, 2)), channel)
    write_log(log, tmp_path / "log.parquet")
    assert read_log(tmp_path / "log.parquet").torque == channel
    assert "delay 3, 1 ms" in repr(log)
    with pytest.raises(LogError, match="3 lags of torques for 2 joints"):
        replace(log, torque=TorqueChannel("held", lags=(0.0, 0.0, 0.1)))
    with pytest.raises(SettingError, match="lags"):
        TorqueChannel("held", lags=(np.nan, 0.0))


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
    run = simulate(replace(load("ideal"), torque=TorqueMeasurement(noise=(0.5, 0.05))), range(12))
    logs = [MotionLog(100.0, run.log.q[i], run.log.tau[i], TorqueChannel("held")) for i in range(12)]
    found = [estimate_delay(log, scara()) for log in logs]
    scatter = np.std([one.delay for one in found], ddof=1)
    assert 0.5 < np.mean([one.sigma for one in found]) / scatter < 2


@pytest.mark.thorough
def test_the_lag_of_a_current_loop_is_found_as_well():
    run = simulate(replace(load("ideal"), drive=AveragedDrive(bandwidth=200.0), timing=Timing(delay=0.003)))
    assert estimate_delay(without_delay(run), scara()).delay == pytest.approx(0.003 + 1 / (2 * np.pi * 200), abs=5e-5)


@pytest.mark.parametrize("apart", [0.0, 0.003])
def test_logs_whose_delays_differ_are_said_to_differ(apart, log, rng):
    """Sigma of one delay for both is then at least their scatter, apart / sqrt(2) for two, less what noise makes of it."""
    each = []
    for late in (0.002, 0.002 + apart):
        tau = np.stack([np.interp(log.t - late, log.t, x) for x in log.tau.T], axis=1)
        each.append(noisy(replace(log, tau=tau), 0, [0.05, 0.005], rng=rng))
    found = estimate_delay(each, scara())
    assert found.delay == pytest.approx(-0.002 - apart / 2, abs=2e-4)
    assert bool(found.of_logs) == bool(apart)
    assert ("the logs differ" in found.words) == bool(apart)
    if apart:
        np.testing.assert_allclose(found.of_logs, [-0.002, -0.005], atol=2e-4)
        assert found.doubt > 0.9 * apart / np.sqrt(2)


def test_what_cannot_be_estimated_is_told(log):
    with pytest.raises(LogError, match="give the runs one by one"):
        estimate_delay(MotionLog(log.fs, log.q[None], log.tau[None], log.torque), scara())
    still = MotionLog(log.fs, np.full_like(log.q, 0.5), log.tau, log.torque)
    with pytest.raises((ExcitationError, ValueError)):
        estimate_delay(still, scara())


@pytest.mark.parametrize("model", ["explicit", "power", "integral"])
def test_standard_errors_contain_that_of_the_delay(log, rng, model):
    """The part of the covariance is d d' sigma^2, d being how the estimate moves with the delay, by fits at two of them.

    Of least squares, whose weights do not depend on the delay.
    """
    drawn = noisy(log, 0, [0.05, 0.0025], rng=rng)

    def fit(delay, sigma=0.0):
        late = replace(drawn, torque=TorqueChannel("held", delay, delay_sigma=sigma))
        return identify(late, scara(), MODELS.create(model), estimator=ESTIMATORS.create("OLS"))

    plain, known = fit(0.001), fit(0.001, 5e-4)
    moved = (fit(0.0011).X - fit(0.0009).X) / 2e-4
    np.testing.assert_array_equal(plain.X, known.X)
    added = np.sqrt(np.diag(known.noise_covariance - plain.noise_covariance))
    np.testing.assert_allclose(added, 5e-4 * np.abs(moved), rtol=0.1, atol=0.02 * plain.standard_errors.min())
    assert not plain.delay_covariance.any()


def test_a_delay_of_several_logs_is_one_error(log):
    """Two logs of the same channel are off together: their parts add before they are squared."""
    torque = TorqueChannel("instantaneous", 0.001, delay_sigma=1e-3)
    one, other = (replace(log, torque=torque), replace(log, torque=replace(torque, delay=0.001 + 1e-9)))
    ols = ESTIMATORS.create("OLS")
    same = identify([one, one], scara(), MODELS.create("explicit"), estimator=ols).delay_covariance
    apart = identify([one, other], scara(), MODELS.create("explicit"), estimator=ols).delay_covariance
    np.testing.assert_allclose(np.diag(same), 2 * np.diag(apart), rtol=1e-3)


@pytest.mark.parametrize("meaning", ["held", "instantaneous"])
def test_a_replay_is_driven_with_the_delay_of_each_joint(meaning, log):
    """Lags of one size are a delay that is longer by it; those that differ are each joint's own."""

    def driven(**channel):
        return mean_torques(replace(log.part(0, 50), torque=TorqueChannel(meaning, **channel)), 1 / log.fs / 4, 4)

    np.testing.assert_allclose(driven(delay=0.001, lags=(0.002, 0.002)), driven(delay=0.003), atol=1e-12)
    mixed = driven(lags=(0.0, 0.004))
    np.testing.assert_array_equal(mixed[..., 0], driven()[..., 0])
    np.testing.assert_array_equal(mixed[..., 1], driven(delay=0.004)[..., 1])
