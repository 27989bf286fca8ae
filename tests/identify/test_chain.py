"""The whole way from a log to X: recovery, several logs, batches, sampling frequencies, wrong input."""

from dataclasses import replace

import numpy as np
import pytest
from builders import SOLVED, noisy

from idbench.identify import (
    CHAINS,
    ESTIMATORS,
    MODELS,
    OPERATORS,
    PREFILTERS,
    Basis,
    CoulombFriction,
    ExcitationError,
    ExplicitModel,
    MotionLog,
    NoMask,
    PowerModel,
    Problem,
    ReversalMask,
    TorqueChannel,
    ViscousFriction,
    idbench_chain,
    identify,
    instants,
    paper_chain,
    scara,
)
from idbench.identify.models import THREE
from idbench.sim.engine.run import ideal_log

CHANNELS = [
    TorqueChannel("instantaneous"),
    *(TorqueChannel(meaning, delay) for meaning in ("held", "averaged", "instantaneous") for delay in (0.007, -0.013, 0.052)),
]


BITS16 = 2 * np.pi / 2**16 / np.sqrt(12)


def rows_of(log, model, chain):
    return Problem((log,), scara(), MODELS.create(model), chain).rows


def error(log, model, chain, truth, **options):
    return identify(log, scara(), model, chain, **options).relative_error_percent(truth)


@pytest.mark.parametrize("operator", OPERATORS.builtin)
@pytest.mark.parametrize("model", SOLVED)
def test_every_model_with_every_operator_recovers_the_truth(model, operator, log, truth):
    """Noise-free: 0.01 %, but for the recursive filter, whose ripple-free stop band the others do not need."""
    chain = replace(idbench_chain(), operator=OPERATORS.create(operator))
    assert error(log, MODELS.create(model), chain, truth).max() < 0.01


@pytest.mark.parametrize("model", ["explicit", "power"])
@pytest.mark.parametrize("chain", CHAINS.builtin)
def test_residuals_of_rows_need_no_columns(model, chain, log, truth):
    """By the linearity of the chain: they are what it makes of Y - W X at every sample."""
    made = CHAINS.create(chain)
    signals, form = made.signals(replace(log, tau=1.1 * log.tau)), MODELS.create(model)
    rows = made.rows(signals, scara(), form)
    left = instants(signals, scara(), form, made, np.array(truth)).in_rows(made)
    np.testing.assert_allclose(left, rows.Y - rows.predicted(np.array(truth)), rtol=0, atol=1e-9 * np.abs(rows.Y).max())


@pytest.mark.parametrize("prefilter", PREFILTERS.builtin)
def test_a_wide_prefilter_is_harmless(prefilter, log, truth):
    """A prefilter of 0.8 of the Nyquist frequency leaves 0.01 % (measured: 0.001 %)."""
    chosen = PREFILTERS.create(prefilter)
    wide = chosen if prefilter == "none" else replace(chosen, cutoff=40.0)
    assert error(log, ExplicitModel(), replace(idbench_chain(), prefilter=wide), truth).max() < 0.01


@pytest.mark.thorough
@pytest.mark.parametrize("model", SOLVED)
def test_the_same_chain_serves_a_log_at_ten_times_the_frequency(model, table1, truth):
    fast = ideal_log(table1.robot, table1.scenario.trajectory.points.sample(1000.0))
    chain = replace(idbench_chain(), trim=table1.scenario.trajectory.rest)
    slow, quick = (identify(log, scara(), MODELS.create(model), chain) for log in (table1.log, fast))
    assert slow.row_count == pytest.approx(quick.row_count, rel=0.03)  # of some a sample decides whether 5 % are left
    np.testing.assert_allclose(slow.condition_number, quick.condition_number, rtol=0.03)
    np.testing.assert_allclose(slow.X, quick.X, rtol=1e-5)
    assert quick.relative_error_percent(truth).max() < 0.001


def test_several_logs_are_one_fit(log, truth):
    half = log.samples // 2
    halves = [MotionLog(log.fs, log.q[part], log.tau[part], log.torque) for part in (slice(half), slice(half, None))]
    both = identify(halves, scara(), PowerModel())
    parts = [identify(part, scara(), PowerModel(), throw=False) for part in halves]
    assert both.row_count == sum(part.row_count for part in parts)
    assert both.relative_error_percent(truth).max() < 0.01


def test_several_logs_may_have_several_frequencies_and_channels(table1, log, truth):
    fast = ideal_log(table1.robot, table1.scenario.trajectory.points.sample(500.0))
    scaled = MotionLog(500.0, fast.q, fast.tau / [2.0, 3.0], TorqueChannel("instantaneous", gain=(2.0, 3.0)))
    assert error([log, scaled], ExplicitModel(), idbench_chain(), truth).max() < 0.01


@pytest.mark.thorough
@pytest.mark.parametrize("name", CHAINS.builtin)
def test_a_batch_is_identified_run_by_run_with_the_same_bits(name, log):
    """Other runs in the batch, failed ones among them, change no bit of a run."""
    q = np.stack([log.q, np.zeros_like(log.q), log.q[::-1]])
    tau = np.stack([log.tau, log.tau, -log.tau[::-1]])
    together = identify(MotionLog(log.fs, q, tau, log.torque), scara(), PowerModel(), CHAINS.create(name), throw=False)
    for run in (0, 2):
        alone = identify(MotionLog(log.fs, q[run], tau[run], log.torque), scara(), PowerModel(), CHAINS.create(name))
        np.testing.assert_array_equal(together.X[run], alone.X)
        np.testing.assert_array_equal(together.covariance[run], alone.covariance)
    assert np.isnan(together.X[1]).all()


@pytest.mark.parametrize("acronym", ["WLS", "GLS", "ML"])
def test_a_run_that_cannot_be_solved_leaves_the_others(acronym, log):
    """Of two runs one stands, or has no torques that move it: the other is as it is alone, with its sigma."""
    one = noisy(log, BITS16, (0.1, 0.005), rng=11)
    both = MotionLog(log.fs, np.stack([one.q, 0 * one.q]), np.stack([one.tau, 0 * one.tau]), log.torque)
    estimator = ESTIMATORS.create(acronym)
    alone, found = (identify(x, scara(), ExplicitModel(), estimator=estimator, throw=False) for x in (one, both))
    assert np.isnan([found.X[1], found.standard_errors[1]]).all()
    np.testing.assert_array_equal(found.X[0], alone.X)
    np.testing.assert_array_equal(found.standard_errors[0], alone.standard_errors)


def test_a_joint_that_never_moves_is_told_with_the_parameters_it_hides(table1):
    waypoints = tuple((q1, 0.3) for q1, _ in table1.scenario.trajectory.waypoints)
    still = replace(table1.scenario.trajectory, waypoints=waypoints)
    log = ideal_log(table1.robot, still.points.sample(100.0))
    with pytest.raises(ExcitationError, match=r"does not excite ZZR1, ZZ2, LMX2, LMY2, Fv2, Fs2: W has rank 3 of 8"):
        identify(log, scara(), ExplicitModel())


def test_a_joint_that_trembles_with_its_encoder_is_told_in_the_power_model(log, rng):
    """One count of 16 bits up and down: every column of joint 2 is there, and says nothing."""
    q = log.q.copy()
    q[:, 1] = rng.integers(0, 2, log.samples) * 2 * np.pi / 2**16
    with pytest.raises(ExcitationError, match="does not excite ZZR1"):
        identify(MotionLog(log.fs, q, log.tau, log.torque), scara(), PowerModel(), paper_chain())


def test_a_basis_may_be_part_of_a_robot(log):
    """Parameters left out cost no error: the friction of a robot whose links are known."""
    basis = Basis(2, (ViscousFriction(), CoulombFriction()))
    assert identify(log, basis, ExplicitModel()).names == ("Fv1", "Fv2", "Fs1", "Fs2")


@pytest.mark.parametrize("channel", CHANNELS)
@pytest.mark.parametrize("model", MODELS.builtin)
@pytest.mark.parametrize("operator", ["fir", "windows", "modulating"])
def test_no_row_looks_further_than_the_declared_halo(operator, model, channel, log, rng):
    """One sample of position or torque is disturbed: rows that move are within the halo, and some do."""
    chain = replace(idbench_chain(), operator=OPERATORS.create(operator))
    k, q, tau = 900, log.q[:1800].copy(), log.tau[:1800].copy()
    chain = replace(chain, mask=ReversalMask(0.1))  # whose speeds do not follow the log
    before = rows_of(MotionLog(100.0, q, tau, channel), model, chain)
    for signal in (q, tau):
        signal[k] += 0.5
        after = rows_of(MotionLog(100.0, q, tau, channel), model, chain)
        signal[k] -= 0.5
        moved = (after.Y != before.Y) | (after.W != before.W).any(axis=-1)
        assert moved.any()
        assert (
            np.abs(before.time - k / 100)[moved].max() <= chain.halo(100.0, channel) + 0.005 + 1e-9
        )  # half a sample: odd windows


def test_the_halo_counts_every_stage():
    """Each stage alone moves it by what it looks at."""
    chain = replace(idbench_chain(), mask=NoMask())
    wide = replace(idbench_chain(), mask=ReversalMask(reach=(0.0, 2.0)))
    plain, held = TorqueChannel("instantaneous"), TorqueChannel("held", 0.02)
    assert chain.halo(100.0, held) - chain.halo(100.0, plain) == pytest.approx(0.02 + 0.06)
    assert idbench_chain().halo(100.0, plain) - chain.halo(100.0, plain) == pytest.approx(0.05)
    assert wide.halo(100.0, plain) - chain.halo(100.0, plain) == pytest.approx(0.14)
    filtered = replace(chain, prefilter=PREFILTERS.create("butterworth"))
    unfiltered = replace(chain, prefilter=PREFILTERS.create("none"))
    assert filtered.halo(100.0, plain) > unfiltered.halo(100.0, plain) + 0.1


@pytest.mark.thorough
@pytest.mark.parametrize("model", THREE)
def test_logging_faster_does_not_make_a_coarse_encoder_worse(model, table1, truth):
    """16 bits at 5 kHz: differences over samples would be 50 times noisier than at 100 Hz, and errors above 100 %."""
    fast = ideal_log(table1.robot, table1.scenario.trajectory.points.sample(5000.0))
    line = 2 * np.pi / 2**16
    coarse = MotionLog(fast.fs, np.round(fast.q / line) * line, fast.tau, fast.torque)
    assert error(coarse, MODELS.create(model), idbench_chain(), truth).max() < 1
