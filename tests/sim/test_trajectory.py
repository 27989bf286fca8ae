"""Quintic moves against SciPy's Hermite polynomials, and the limits that the fastest reach."""

import numpy as np
import pytest
from scipy.interpolate import BPoly

from idbench.sim.trajectories import PointToPoint
from idbench.sim.trajectories.point_to_point import PEAK_VELOCITY

PEAK_ACCELERATION = 10 / np.sqrt(3)  # Largest |d2s/du2| of s(u) = 10 u^3 - 15 u^4 + 6 u^5, at u = 1/2 - 1/sqrt(12)

POINTS = [[0.0, 1.0, -0.5], [0.7, -0.4, 0.1], [0.2, 0.9, 1.3]]


@pytest.fixture
def moves():
    return PointToPoint(np.array(POINTS), np.array([1.2, 0.7]), np.array([0.5, 0.3, 0.4]))


def fastest(points, velocity, acceleration):
    """Shortest moves that keep the joints' limits of velocity [rad/s] and acceleration [rad/s^2]."""
    change = np.abs(np.diff(points, axis=0))
    durations = np.maximum(PEAK_VELOCITY * change / velocity, np.sqrt(PEAK_ACCELERATION * change / acceleration)).max(axis=1)
    return PointToPoint(np.array(points), durations, np.zeros(len(points)))


def test_the_motion_is_the_quintic_hermite_interpolant(moves):
    """Position given, velocity and acceleration zero at both ends of each move: one polynomial of degree 5 does that."""
    times = [0.5, 1.7, 2.0, 2.7]
    values = [[[np.array(POINTS[i])[j], 0, 0] for i in (0, 1, 1, 2)] for j in range(3)]
    reference = moves.sample(250.0)
    t = np.arange(len(reference.q)) / 250.0
    assert len(t) == round(3.1 * 250)
    for j in range(3):
        exact = BPoly.from_derivatives(times, values[j])
        inside = (t >= times[0]) & (t < times[-1])
        for order, found in enumerate((reference.q, reference.qd, reference.qdd)):
            np.testing.assert_allclose(found[inside, j], exact(t[inside], order), atol=1e-11)
    rest = t >= times[-1]
    np.testing.assert_array_equal(reference.qd[rest], 0)
    np.testing.assert_allclose(reference.q[rest], np.broadcast_to(POINTS[-1], (rest.sum(), 3)), atol=1e-15)


def test_it_rests_before_the_start_and_after_the_end(moves):
    outside = moves.at(np.array([-1.0, 9.0]), 100.0)
    np.testing.assert_allclose(outside.q, [POINTS[0], POINTS[-1]], atol=1e-15)
    np.testing.assert_array_equal(outside.qd, 0)
    np.testing.assert_array_equal(outside.qdd, 0)


def test_sampling_is_exact_whatever_the_frequency(moves):
    np.testing.assert_allclose(moves.sample(1000.0).q[::10], moves.sample(100.0).q, atol=1e-14)


@pytest.mark.parametrize("limit", ["velocity", "acceleration"])
def test_the_fastest_moves_reach_a_limit_and_pass_none(limit):
    velocity, acceleration = ([0.6, 0.7, 0.8], [99.0] * 3) if limit == "velocity" else ([99.0] * 3, [2.0, 3.0, 4.0])
    moves = fastest(POINTS, velocity, acceleration)
    t = np.linspace(0, moves.duration, 200001)
    found = moves.at(t, 1.0)
    used = np.abs(found.qd) / velocity if limit == "velocity" else np.abs(found.qdd) / acceleration
    first = t <= moves.durations[0]
    assert used[first].max() == pytest.approx(1, abs=1e-6)
    assert used[~first].max() == pytest.approx(1, abs=1e-6)
