"""Two levels of noise from squares that they explain together."""

import numpy as np
import pytest

from idbench.identify.noise.row_weights import two_levels


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
