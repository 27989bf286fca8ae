import numpy as np
import pytest

from idbench.identify import LogError, MotionLog, SettingError, TorqueChannel

CHANNEL = TorqueChannel("held", 0.003)
Q = np.zeros((100, 2))


def test_arrays_are_copies_that_cannot_be_written():
    q = np.zeros((10, 2))
    log = MotionLog(100, q, q, CHANNEL)
    q[0, 0] = 7
    assert log.q[0, 0] == 0
    with pytest.raises(ValueError, match="read-only"):
        log.q[0, 0] = 1


def with_value(value):
    q = Q.copy()
    q[17, 1] = value
    return q


@pytest.mark.parametrize(
    ("q", "tau", "message"),
    [
        (with_value(np.nan), Q, "q is nan at sample 17 of joint 2"),
        (Q, with_value(-np.inf), "tau is -inf at sample 17 of joint 2"),
        (Q, Q[:-1], r"q has shape \(100, 2\) and tau \(99, 2\)"),
        (Q[:, 0], Q[:, 0], r"q has shape \(100,\), not"),
        (Q[:0], Q[:0], r"q has shape \(0, 2\), not"),
    ],
)
def test_unusable_samples_are_refused(q, tau, message):
    with pytest.raises(LogError, match=message):
        MotionLog(100, q, tau, CHANNEL)


def test_the_run_of_a_bad_sample_is_named():
    with pytest.raises(LogError, match=r"sample 17 of joint 2 of run \(1,\)"):
        MotionLog(100, np.stack([Q, with_value(np.nan)]), np.stack([Q, Q]), CHANNEL)


@pytest.mark.parametrize("fs", [0, -1, np.nan, np.inf])
def test_impossible_sampling_frequencies_are_refused(fs):
    with pytest.raises(SettingError, match="fs ="):
        MotionLog(fs, Q, Q, CHANNEL)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"meaning": "hold"}, "'hold' is unknown; known: instantaneous, held, averaged"),
        ({"meaning": "held", "delay": np.nan}, "delay = nan"),
        ({"meaning": "held", "gain": 0.0}, "gain = 0.0"),
        ({"meaning": "held", "gain": (1.0, np.inf)}, "gain ="),
        ({"meaning": "held", "gain": "2 N m/A"}, "gain = '2 N m/A' must be a number"),
        ({"meaning": "held", "delay": "2 ms"}, "delay = '2 ms' must be a finite number"),
    ],
)
def test_impossible_channels_are_refused(settings, message):
    with pytest.raises(SettingError, match=message):
        TorqueChannel(**settings)


def test_gains_must_fit_the_joints():
    with pytest.raises(LogError, match="3 torque gains for 2 joints"):
        MotionLog(100, Q, Q, TorqueChannel("held", gain=(1.0, 2.0, 3.0)))


def test_uniform_times_give_the_sampling_frequency(rng):
    t = 5 + np.arange(100) / 250
    jittered = t + rng.uniform(-0.4, 0.4, 100) * 0.01 / 250  # steps within 0.8 % of the mean
    assert MotionLog.at_times(jittered, Q, Q, CHANNEL).fs == pytest.approx(250, rel=1e-3)


@pytest.mark.parametrize(
    ("t", "message"),
    [
        (np.arange(100) / 100 + 0.02 * (np.arange(100) > 60), r"a step of 0\.03 s after t = 0\.6 s"),
        (np.where(np.arange(100) == 40, 0.0, np.arange(100) / 100), r"t = 0\.39 s is followed by 0 s at sample 40"),
        (np.arange(99) / 100, "one time is needed for each sample"),
        (np.full(100, np.nan), "t is nan at sample 0"),
    ],
)
def test_times_that_are_not_uniform_are_refused(t, message):
    with pytest.raises(LogError, match=message):
        MotionLog.at_times(t, Q, Q, CHANNEL)


def test_one_sample_tells_no_frequency():
    with pytest.raises(LogError, match="1 samples do not give"):
        MotionLog.at_times(np.zeros(1), Q[:1], Q[:1], CHANNEL)


def test_times_that_drift_are_refused():
    """Every step within 1 % of the mean, and yet the middle of the log is 0.9 samples off."""
    t = np.cumsum(np.where(np.arange(200) < 100, 0.00991, 0.01009))
    with pytest.raises(LogError, match=r"time drifts: t = .* is 0\.00\d+ s from where uniform sampling"):
        MotionLog.at_times(t, np.zeros((200, 2)), np.zeros((200, 2)), CHANNEL)
