import numpy as np
import pytest

from identify import NoMask, ReversalMask, SettingError


@pytest.mark.parametrize("fs", [100.0, 1000.0])
def test_instants_near_standstill_are_left_out_with_their_surroundings(fs):
    t = np.arange(-fs, fs + 1) / fs
    weight = ReversalMask(threshold=0.1, width=0.03).weight(t[None, :], fs)[0]  # qd = t: slow while |t| <= 0.1 s
    np.testing.assert_array_equal(weight, np.abs(t) > 0.13 + 1e-9)


def test_each_joint_has_its_own_weights():
    qd = np.array([np.zeros(50), np.ones(50)])
    np.testing.assert_array_equal(ReversalMask().weight(qd, 100.0), qd)
    np.testing.assert_array_equal(NoMask().weight(qd, 100.0), np.ones((2, 50)))


@pytest.mark.parametrize("settings", [{"threshold": 0.0}, {"width": -0.1}, {"width": np.nan}])
def test_impossible_settings_are_refused(settings):
    with pytest.raises(SettingError):
        ReversalMask(**settings)


def test_a_turn_between_two_samples_is_seen():
    """So fast that no sample is below the threshold."""
    qd = np.array([[3.0] * 10 + [-3.0] * 10])
    np.testing.assert_array_equal(
        ReversalMask(0.1, 0.03).weight(qd, 100.0)[0] == 0, (np.arange(20) >= 6) & (np.arange(20) <= 13)
    )
