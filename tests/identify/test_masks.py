from dataclasses import replace

import numpy as np
import pytest

from idbench.identify import NoMask, NoPrefilter, ReversalMask, idbench_chain
from idbench.identify.signals.masks import slow_speed
from idbench.identify.signals.prefilters import NoisePrefilter


@pytest.mark.parametrize("fs", [100.0, 1000.0])
def test_instants_near_standstill_are_left_out_with_their_surroundings(fs):
    t = np.arange(-fs, fs + 1) / fs
    weight = ReversalMask(threshold=0.1, width=0.03, taper=0.0).weight(t[None, :], fs)[0]  # qd = t: slow while |t| <= 0.1 s
    np.testing.assert_array_equal(weight, np.abs(t) > 0.13 + 1e-9)


def test_each_joint_has_its_own_weights():
    qd = np.array([np.zeros(50), np.ones(50)])
    np.testing.assert_array_equal(ReversalMask().weight(qd, 100.0), qd)
    np.testing.assert_array_equal(NoMask().weight(qd, 100.0), np.ones((2, 50)))


def test_a_turn_between_two_samples_is_seen():
    """So fast that no sample is below the threshold."""
    qd = np.array([[3.0] * 10 + [-3.0] * 10])
    np.testing.assert_array_equal(
        ReversalMask(0.1, 0.03, 0.0).weight(qd, 100.0)[0] == 0, (np.arange(20) >= 6) & (np.arange(20) <= 13)
    )


@pytest.mark.parametrize("fs", [100.0, 1000.0])
def test_weights_rise_over_the_taper(fs):
    """From the end of the width to its end, smoothly: no step is larger than twice that of a straight rise."""
    t = np.arange(-fs, fs + 1) / fs
    weight = ReversalMask(0.1, 0.03, 0.1).weight(t[None, :], fs)[0]
    np.testing.assert_array_equal(weight[np.abs(t) <= 0.13 + 1e-9], 0)
    np.testing.assert_allclose(weight[np.abs(t) >= 0.23 + 1.5 / fs], 1)
    assert (np.diff(weight[t > 0]) >= 0).all()
    assert np.diff(weight).max() <= 2 / (0.1 * fs)


def test_a_gradual_mask_keeps_high_frequencies_out_of_low_ones():
    """White noise differentiated twice, times the weights: what reaches 0 to 1 Hz falls by 10 with the taper."""
    fs, rng = 100.0, np.random.default_rng(0)
    noise = np.diff(rng.normal(size=20002), 2)
    qd = np.sin(2 * np.pi * 0.4 * np.arange(20000) / fs)[None]

    def leaked(taper):
        weight = ReversalMask(taper=taper).weight(qd, fs)[0]
        return np.abs(np.fft.rfft(weight * noise))[:200].std()

    assert leaked(0.1) < leaked(0.0) / 10


def test_the_slow_speed_is_a_share_of_the_rms_speed_or_four_times_the_noise(rng):
    t = np.arange(4000) / 100
    fast = 2.0 * np.sin(t)
    assert slow_speed(fast) == pytest.approx(0.05 * np.sqrt(2), rel=0.01)
    assert slow_speed(fast + 0.05 * rng.standard_normal(len(t))) == pytest.approx(0.2, rel=0.05)


def test_a_wide_mask_is_that_of_its_joint_alone():
    """Up to a multiple of the slow speed, with the width and taper of old: 30 and 100 ms."""
    qd = np.tile(np.sin(2 * np.pi * 0.4 * np.arange(1000) / 100), (2, 1))
    mixed = ReversalMask(0.1, reach=(0.0, 2.0)).weight(qd, 100.0)
    np.testing.assert_array_equal(mixed[0], ReversalMask(0.1).weight(qd, 100.0)[0])
    np.testing.assert_array_equal(mixed[1], ReversalMask(0.2, 0.03, 0.1).weight(qd, 100.0)[1])


def test_positions_are_filtered_where_they_are_noisy_and_only_there(log):
    """Encoder counts of 16 bits are, an exact log is not; above the Nyquist frequency there is nothing to filter."""
    counts = 2 * np.pi / 2**16
    noisy = replace(log, q=counts * np.round(log.q / counts))
    chain = idbench_chain()
    assert chain.suited_prefilter(noisy) == NoisePrefilter(15.0, 0.0)
    assert chain.suited_prefilter(log) == NoPrefilter()
    high = NoisePrefilter(60.0)
    np.testing.assert_array_equal(high.apply(log.q.T, log.fs), log.q.T)
    assert high.halo(log.fs) == 0
