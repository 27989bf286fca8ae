"""Validation on held-out motion: known errors are measured correctly."""

from dataclasses import replace

import numpy as np
import pytest
from builders import noisy

from idbench.identify import (
    ExplicitModel,
    LogError,
    MotionLog,
    NoMask,
    Problem,
    ReversalMask,
    TorqueChannel,
    idbench_chain,
    scara,
    split,
    validate,
)

CHANNEL = TorqueChannel("instantaneous")


def judged(log, X, covariance=None, chain=None):
    return validate(Problem((log,), scara(), ExplicitModel(), chain or idbench_chain()), X, covariance)


def test_the_truth_foretells_ideal_data(log, truth):
    found = judged(log, truth)
    assert (found.percent < 1e-3).all()
    assert (1 - found.R2 < 1e-9).all()
    assert np.isfinite(found.standing).all()


def test_a_log_that_begins_and_ends_at_full_speed_is_judged_as_well(log, truth):
    """Its first and last rows lie as far from its ends as the chain looks, and ask for nothing beyond them."""
    speed = np.abs(np.diff(log.q, axis=0)) * log.fs
    fast = np.flatnonzero((speed > 0.5 * speed.max(axis=0)).any(axis=1))
    begin = fast[len(fast) // 4]
    found = judged(log.part(begin, fast[fast > begin + 1000][0]), truth)
    assert (found.percent < 1e-3).all()


def test_a_gain_error_is_told_in_percent(log, truth):
    found = judged(log, 1.05 * truth)
    np.testing.assert_allclose(found.percent, 5, rtol=1e-3)
    assert not found.white.any()


@pytest.mark.parametrize("mask", [ReversalMask(), NoMask()])
def test_a_constant_error_has_its_own_size(log, truth, mask):
    """What rows lose to the mask is given back, where joints move and where they stand."""
    off = MotionLog(log.fs, log.q, log.tau + [1.0, 0.1], CHANNEL)
    found = judged(off, truth, chain=replace(idbench_chain(), mask=mask))
    np.testing.assert_allclose(found.rms, [1.0, 0.1], rtol=1e-3)
    assert (found.standing > [0.7, 0.07]).all()  # friction of the ideal robot comes on top


def test_fits_with_any_mask_and_without_are_judged_on_the_same_rows(log, truth):
    wrong = truth * [1, 1, 1, 1, 0.9, 1, 1, 1]
    masked = judged(log, wrong, chain=replace(idbench_chain(), mask=ReversalMask()))
    for mask in (NoMask(), ReversalMask(0.5), ReversalMask((0.01, 2.0))):
        other = judged(log, wrong, chain=replace(idbench_chain(), mask=mask))
        np.testing.assert_array_equal(masked.rms, other.rms)
        np.testing.assert_array_equal(masked.R2, other.R2)


def test_noise_is_told_by_its_rms_and_is_white(log, truth, rng):
    """A low-pass of unit gain leaves of white noise the share sum h^2."""
    sigma = np.array([0.5, 0.025])
    chain = idbench_chain()
    found = judged(noisy(log, 0, sigma, rng=rng), truth)
    passed = np.sqrt(np.sum(chain.operator.response(log.fs) ** 2))
    # Rows of which the mask takes a part are smaller: at most as large as those of all.
    assert (found.rms < 1.1 * sigma * passed).all()
    assert (found.rms > 0.5 * sigma * passed).all()


def test_white_noise_is_mostly_called_white(log, truth):
    """In 95 % without a mask; rows beside masked ones correlate, which leaves 90 % (200 seeds), here of 80 to 3 %."""
    white = [judged(noisy(log, 0, [0.5, 0.025], rng=seed), truth).white for seed in range(40)]
    assert 0.8 < np.mean(white) < 1


def test_what_stands_is_judged_apart(log, truth):
    """Friction that is off where a joint stands is no error of the moving joint."""
    chain = idbench_chain()
    standing = chain.mask.weight(chain.signals(log).state.qd, log.fs).T == 0
    wrong = MotionLog(log.fs, log.q, log.tau + standing * [0.4, 0.08], CHANNEL)
    found = judged(wrong, truth)
    assert (found.percent < 1e-3).all()
    assert (found.standing > [0.05, 0.01]).all()


def test_a_joint_that_never_moves_takes_no_judgement_from_the_others(log, truth):
    found = judged(MotionLog(log.fs, log.q * [1, 0], log.tau, CHANNEL), truth)
    assert np.isnan(found.percent[1])
    assert np.isfinite(found.percent[0])
    with pytest.raises(LogError, match="no joint moves in this log"):
        judged(MotionLog(log.fs, log.q * [0, 0], log.tau, CHANNEL), truth)


def test_the_end_of_a_log_is_held_out(log):
    first, rest = split(log, 0.25)
    assert first.samples + rest.samples == log.samples
    assert rest.samples == pytest.approx(0.25 * log.samples, abs=1)
    np.testing.assert_array_equal(np.concatenate([first.q, rest.q]), log.q)


@pytest.mark.parametrize("sigma", [(0.5, 0.025), (0.05, 0.005)])
def test_the_noise_of_a_log_is_read_off_above_its_band(log, truth, sigma):
    """White noise of the torques, by another route: what a low-pass of unit gain and the mask leave of it, to a fifth."""
    found = judged(noisy(log, 0, sigma), truth)
    np.testing.assert_allclose(found.noise, found.rms, rtol=0.2)  # the truth leaves nothing else
    assert (found.excess == 0).all()


def test_a_wrong_model_does_not_pass_for_noise(log, truth):
    """LMX2 too small by a tenth, on the noisy log: what is beyond noise is what it is without any."""
    wrong = truth * [1, 1, 1, 1, 0.9, 1, 1, 1]
    drawn, exact = (judged(one, wrong) for one in (noisy(log, 0, [0.05, 0.005]), log))
    np.testing.assert_allclose(drawn.excess, exact.rms, rtol=0.05)


def test_sigma_of_the_parameters_is_expected_too(log, truth):
    """A covariance of one parameter: the rms of its column times its sigma."""
    C = np.zeros((8, 8))
    C[4, 4] = 0.01**2
    found = judged(log, truth, C)
    off = judged(log, truth + 0.01 * np.eye(8)[4])
    np.testing.assert_allclose(found.open, off.rms, rtol=1e-3)


def test_slow_sampling_leaves_the_noise_unknown(log, truth):
    """At 12.5 Hz nothing lies above the band of 5 Hz."""
    slow = MotionLog(12.5, log.q[::8], log.tau[::8], CHANNEL)
    assert np.isnan(judged(slow, truth).noise).all()
