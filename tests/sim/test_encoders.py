"""Encoders: each setting shows its physical effect."""

import numpy as np
import pytest

from idbench.sim.encoders import ExactEncoder, IncrementalEncoder
from idbench.sim.errors import ScenarioError

N = 4000
Q = np.linspace(-1.0, 1.5, N)[:, None, None] * np.array([1.0, -0.7])  # (sample, nsim, joint)


def read(encoder, q=Q, seed=0):
    reader = encoder.start(2, len(q), 100.0, [np.random.default_rng(seed)])
    return np.array([reader.read(k, x) for k, x in enumerate(q)])


def test_exact_is_exact():
    np.testing.assert_array_equal(read(ExactEncoder()), Q)


@pytest.mark.parametrize("quadrature", [1, 2, 4])
def test_counts_are_whole_and_the_nearest(quadrature):
    """Lines times quadrature make a turn, a number a joint; rounding errs by half a count at most, evenly."""
    lines = np.array([1000, 333])
    read_out = read(IncrementalEncoder(lines=tuple(lines.tolist()), quadrature=quadrature))
    count = 2 * np.pi / (lines * quadrature)
    np.testing.assert_allclose(read_out / count, np.rint(read_out / count), atol=1e-9)
    error = (read_out - Q) / count
    assert 0.49 < np.abs(error).max() <= 0.5 + 1e-9
    assert abs(error.mean()) < 0.01


def test_the_offset_moves_where_counts_begin():
    count = 2 * np.pi / 4000
    error = (read(IncrementalEncoder(lines=1000, offset=0.0)) - Q) / count
    assert error.max() <= 1e-9  # rounds down
    assert error.mean() == pytest.approx(-0.5, abs=0.01)


def test_interpolation_error_repeats_with_the_signal_period():
    """Its fundamental at the period of a line has the stated amplitude: 3 % of a period is many counts here."""
    encoder = IncrementalEncoder(lines=200, quadrature=4, interpolation_error=0.03)
    period = 2 * np.pi / 200
    fine = np.linspace(0, 40 * period, N, endpoint=False)[:, None, None] * np.ones(2)
    error = (read(encoder, fine) - fine)[:, 0, 0] / period
    fundamental = 2 * np.mean(error * np.sin(2 * np.pi * fine[:, 0, 0] / period))
    # Quantization to a quarter of a period has a fundamental of its own; what the error adds is the difference.
    ideal = (read(IncrementalEncoder(lines=200, quadrature=4), fine) - fine)[:, 0, 0] / period
    assert fundamental != pytest.approx(2 * np.mean(ideal * np.sin(2 * np.pi * fine[:, 0, 0] / period)), abs=0.005)
    assert np.abs(error).max() < 0.125 + 0.031 + 1e-9


def test_white_noise_is_added_before_counting():
    error = read(IncrementalEncoder(lines=2**22, noise=1e-3)) - Q
    assert error.std() == pytest.approx(1e-3, rel=0.05)
    assert abs(np.corrcoef(error[1:, 0, 0], error[:-1, 0, 0])[0, 1]) < 0.06


def test_missed_counts_stay_missed_and_are_lost_in_the_direction_of_motion():
    encoder = IncrementalEncoder(lines=1000, missed_counts=2.0)
    lost = (read(encoder) - read(IncrementalEncoder(lines=1000))) / (2 * np.pi / 4000)
    steps = np.rint(np.diff(lost, axis=0))
    assert set(np.unique(steps[:, 0, 0])) <= {-1.0, 0.0}  # joint 1 goes up, and what is lost lowers the count
    assert set(np.unique(steps[:, 0, 1])) <= {0.0, 1.0}
    # 40 s at 2 a second, but the joint moves by a count in 40 % of the samples alone: 32, with a scatter of 6.
    assert 14 < -lost[-1, 0, 0] < 50


def test_a_standing_joint_loses_nothing():
    still = np.zeros((N, 1, 2))
    np.testing.assert_array_equal(read(IncrementalEncoder(missed_counts=50.0), still), 0.0)


def test_more_missed_counts_than_samples_are_refused():
    with pytest.raises(ScenarioError, match=r"encoder.missed_counts = 200 1/s must be at most fs = 100 Hz"):
        read(IncrementalEncoder(missed_counts=200.0))
