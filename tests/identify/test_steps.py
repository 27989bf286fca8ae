"""How far rounds still have to go, and where they go on."""

import numpy as np
import pytest

from idbench.identify.estimators.simulating.simulated_rounds import SecantSteps, largest

TRUTH = np.array([1.0, -2.0, 0.5])


def rounds(J, steps, X, most=40):
    """Run X -> TRUTH + J (X - TRUTH) until a tenth is left; return how often, what was said to be left, and what was."""
    for k in range(most):
        G = TRUTH + J @ (X - TRUTH)
        left, after = steps.taken(X, G, np.ones(3)) if steps and k else (largest(G - X), G)
        if k and left < 0.1:
            break
        X = after
    return k + 1, left, np.abs(G - TRUTH).max()


def test_a_share_that_is_left_each_time_is_foreseen():
    """40 %, of which a step alone says nothing; where all directions are alike the second jump is the last."""
    start = TRUTH + [40.0, 0.0, 0.0]
    plain, said, off = rounds(0.4 * np.eye(3), None, start)
    assert 0.5 * said < off < said
    jumps, said, off = rounds(0.4 * np.eye(3), SecantSteps(), start)
    assert jumps <= 4 < plain
    assert off <= said + 1e-12


@pytest.mark.parametrize(
    ("shares", "start"),
    [((0.6, 0.3, -0.2), (40, -30, 20)), ((0.9, 0.01, 0.01), (2.2, 1000, 1)), ((0.9, 0.9, 0.9), (40, 30, 20))],
)
def test_hardly_more_is_left_than_is_said(shares, start):
    """Also where rounds hardly lead anywhere, and where the largest step is none of the direction that lags."""
    _, said, off = rounds(np.diag(shares), SecantSteps(), TRUTH + start)
    assert off < 1.5 * said


def test_of_random_rounds_hardly_more_is_left_than_is_said(rng):
    """Rounds that leave between -40 and 50 %, in directions of their own."""
    for _ in range(200):
        V = np.linalg.qr(rng.standard_normal((3, 3)))[0]
        J = V @ np.diag(rng.uniform(-0.4, 0.5, 3)) @ V.T
        jumps, said, off = rounds(J, SecantSteps(), TRUTH + 30 * rng.standard_normal(3))
        assert off < 1.5 * said < 0.15
        assert jumps < 15


def test_rounds_that_lead_away_are_never_settled(rng):
    X, steps = TRUTH + 1e-3, SecantSteps()
    for _ in range(9):
        G = TRUTH + 3.0 * (X - TRUTH)
        left, X = steps.taken(X, G, np.full(3, 0.1))
    assert left > 1


def test_runs_beside_each_other_do_not_matter_to_each_other(rng):
    X, J, both, alone = TRUTH + rng.standard_normal((2, 3)), rng.uniform(-0.4, 0.5, (2, 3)), SecantSteps(), SecantSteps()
    for _ in range(4):
        G = TRUTH + J * (X - TRUTH)
        left, after = both.taken(X, G, np.ones((2, 3)))
        single, where = alone.taken(X[1], G[1], np.ones(3))
        np.testing.assert_array_equal(left[1], single)
        np.testing.assert_array_equal(after[1], where)
        X = after


def test_nothing_moves_where_nothing_is_left():
    steps, X = SecantSteps(), np.stack([TRUTH, TRUTH])
    for _ in range(3):
        left, after = steps.taken(X, X, np.ones((2, 3)))
        np.testing.assert_array_equal(left, 0.0)
        np.testing.assert_array_equal(after, X)
