import numpy as np
import pytest

from idbench.identify import LogError, MotionLog, TorqueChannel

CHANNEL = TorqueChannel("held", 0.003)
Q = np.zeros((100, 2))


def test_arrays_are_copies_that_cannot_be_written():
    q = np.zeros((10, 2))
    log = MotionLog(100, q, q, CHANNEL)
    q[0, 0] = 7
    assert log.q[0, 0] == 0
    with pytest.raises(ValueError, match="read-only"):
        log.q[0, 0] = 1


def test_lists_integers_and_masked_arrays_without_a_mask_are_taken():
    assert MotionLog(100, [[1, 2], [3, 4]], [[1, 2], [3, 4]], CHANNEL).q.dtype == np.float64
    assert MotionLog(100, np.ma.array(np.zeros((3, 2))), np.zeros((3, 2)), CHANNEL).samples == 3


def test_uniform_times_give_the_sampling_frequency(rng):
    t = 5 + np.arange(100) / 250
    jittered = t + rng.uniform(-0.4, 0.4, 100) * 0.01 / 250  # steps within 0.8 % of the mean
    assert MotionLog.at_times(jittered, Q, Q, CHANNEL).fs == pytest.approx(250, rel=1e-3)


def test_times_that_drift_are_refused():
    """Every step within 1 % of the mean, and yet the middle of the log is 0.9 samples off."""
    t = np.cumsum(np.where(np.arange(200) < 100, 0.00991, 0.01009))
    with pytest.raises(LogError, match=r"time drifts: t = .* is 0\.00\d+ s from where uniform sampling"):
        MotionLog.at_times(t, np.zeros((200, 2)), np.zeros((200, 2)), CHANNEL)
