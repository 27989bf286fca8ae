"""How far rounds still have to go, and where they go on."""

import numpy as np

from identify.estimators.steps import SecantSteps, Steps

TRUTH = np.array([1.0, -2.0, 0.5])


def rounds(J, steps, X, most=40):
    """Run X -> TRUTH + J (X - TRUTH) until a tenth is left; return how often, what was said to be left, and what was."""
    for k in range(most):
        G = TRUTH + J @ (X - TRUTH)
        left, after = steps.taken(X, G, np.ones(3), comparable=k > 0)
        if k and left < 0.1:
            break
        X = after
    return k + 1, left, np.abs(G - TRUTH).max()


def test_a_share_that_is_left_each_time_is_foreseen():
    """40 %, of which a step alone says nothing; where all directions are alike the second jump is the last."""
    start = TRUTH + [40.0, 0.0, 0.0]
    plain, said, off = rounds(0.4 * np.eye(3), Steps(), start)
    assert 0.5 * said < off < said
    jumps, said, off = rounds(0.4 * np.eye(3), SecantSteps(), start)
    assert jumps <= 4 < plain
    assert off <= said + 1e-12


def test_several_shares_settle_sooner_and_within_what_is_said():
    J, start = np.diag([0.6, 0.3, -0.2]), TRUTH + [40.0, -30.0, 20.0]
    plain, *_ = rounds(J, Steps(), start)
    jumps, said, off = rounds(J, SecantSteps(), start)
    assert jumps < plain
    assert off < 2 * said


def test_rounds_that_lead_away_are_not_followed_further():
    """What grows is not extrapolated, nor taken for settled; runs beside each other do not matter to each other."""
    X = np.stack([TRUTH + 1.0, TRUTH + 1.0])
    J, both, alone = np.array([3.0, 0.5])[:, None], SecantSteps(), SecantSteps()
    for k in range(3):
        G = TRUTH + J * (X - TRUTH)
        left, after = both.taken(X, G, np.ones((2, 3)), comparable=True)
        single, where = alone.taken(X[1], G[1], np.ones(3), comparable=True)
        np.testing.assert_array_equal(left[1], single)
        np.testing.assert_array_equal(after[1], where)
        X = after if k == 0 else G
    assert left[0] >= np.abs(G - X).max() or left[0] > 1


def test_nothing_moves_where_nothing_is_left():
    steps, X = SecantSteps(), np.stack([TRUTH, TRUTH])
    for _ in range(3):
        left, after = steps.taken(X, X, np.ones((2, 3)), comparable=True)
        np.testing.assert_array_equal(left, 0.0)
        np.testing.assert_array_equal(after, X)
