"""How the variance of rows depends on what noise makes of them."""

import numpy as np
import pytest

from idbench.identify.noise.row_weights import MAX_RATIO, MIN_RATIO, floor_of, reciprocal_root, rectified, two_levels

ALL = np.ones((200, 400), dtype=bool)


@pytest.fixture
def variance(rng):
    return np.exp(rng.normal(size=(200, 400)))


def test_a_floor_is_found(variance, rng):
    """Over 200 runs of 400 rows each; the ratio of two fitted numbers is known to some per cent."""
    mean = variance.mean(axis=-1, keepdims=True)
    squares = (variance + 0.5 * mean) * rng.standard_normal(variance.shape) ** 2
    assert np.median(floor_of(squares, variance, ALL) / mean[:, 0]) == pytest.approx(0.5, rel=0.1)


def test_pure_noise_has_next_to_none_and_equal_residuals_the_most(variance, rng):
    mean = variance.mean(axis=-1)
    noise = rng.standard_normal(variance.shape) ** 2
    assert np.median(floor_of(variance * noise, variance, ALL) / mean) < 0.05
    np.testing.assert_allclose(floor_of(np.ones_like(variance), variance, ALL), MAX_RATIO * mean)


def test_a_run_does_not_touch_the_others_and_bad_ones_have_a_value(variance):
    squares = variance.copy()
    squares[3] = np.nan
    found = floor_of(squares, variance, ALL)
    np.testing.assert_array_equal(found[7], floor_of(squares[7], variance[7], ALL[7]))
    assert np.isfinite(found).all()
    assert (found >= MIN_RATIO * variance.mean(axis=-1)).all()


def test_reciprocal_roots():
    scale = reciprocal_root(np.array([[3.0, 8.0], [0.0, 0.0], [np.nan, 1.0]]), np.array([1.0, 0.0, 1.0]))
    np.testing.assert_allclose(scale, [[1 / 2, 1 / 3], [1, 1], [1, 1 / np.sqrt(2)]])


def test_noise_is_rectified_where_it_is_larger_than_the_signal(rng):
    """To what a million draws leave."""
    x, n = np.array([0.0, 0.5, -1.0, 3.0, 10.0]), 0.7 * rng.standard_normal(10**6)
    drawn = [np.mean(np.abs(one + n)) - abs(one) for one in x]
    np.testing.assert_allclose(rectified(x, np.array(0.7)), drawn, atol=3e-3)
    np.testing.assert_array_equal(rectified(x, np.array(0.0)), 0.0)


def test_void_rows_say_nothing(variance, rng):
    squares = (variance + variance.mean(axis=-1, keepdims=True)) * rng.standard_normal(variance.shape) ** 2
    half = np.arange(variance.shape[-1]) % 2 == 0
    valid = np.broadcast_to(half, variance.shape)
    alone = floor_of(squares[:, half], variance[:, half], ALL[:, half])
    np.testing.assert_allclose(floor_of(np.where(valid, squares, 0.0), variance, valid), alone, rtol=1e-9)


@pytest.fixture
def shapes():
    """A flat spectrum, and one that grows as f^4 and is ten thousand times as strong in all."""
    f = np.linspace(0.0, 1.0, 400)
    return np.ones(400), 5e4 * f**4


def test_the_weak_one_is_found_below_the_strong_one(shapes, rng):
    """Of 300 periodograms; the sum of squares, known to 10 % from some 100 values that count, would not show 1e-4 of it.

    To what six rounds leave.
    """
    flat, steep = shapes
    squares = (2.0 * flat + steep) * rng.exponential(size=(300, 400))
    a, b = two_levels(flat, steep, squares)
    assert np.median(a) == pytest.approx(2.0, rel=0.1)
    assert np.median(b) == pytest.approx(1.0, rel=0.05)


def test_levels_are_not_negative_and_none_comes_of_nothing(shapes, rng):
    flat, steep = shapes
    squares = steep * rng.exponential(size=(50, 400))
    a, _ = two_levels(flat, steep, squares)
    assert (a >= 0).all()
    assert np.median(a) < 0.05 * np.mean(squares)
    nothing = np.zeros(400)
    assert two_levels(flat, nothing, 3.0 * flat) == (pytest.approx(3.0), 0.0)
    assert two_levels(flat, steep, nothing) == (0.0, 0.0)
