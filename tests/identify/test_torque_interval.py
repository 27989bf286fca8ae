"""Intervals of torques: they contain the share of held-out torques that they state, and say what lies outside of the fit."""

from dataclasses import replace

import numpy as np
import pytest
import scipy

from idbench.identify import ESTIMATORS, MODELS, MotionLog, Problem, identify, scara
from idbench.identify.judge.torque_interval import _left_out, torque_interval


def coloured(log, seed, time=0.3, size=(0.5, 0.025)):
    """Return a log with errors of the torques that are correlated over some time."""
    rng, a = np.random.default_rng(seed), np.exp(-1 / (log.fs * time))
    error = scipy.signal.lfilter([np.sqrt(1 - a**2)], [1.0, -a], rng.standard_normal(log.tau.shape), axis=0)
    return replace(log, tau=log.tau + np.array(size) * error)


@pytest.mark.parametrize("logs", [1, 3])
def test_they_contain_95_percent_of_another_log(log, logs):
    """Errors of 0.3 s on 46 s, some 80 independent ones a joint: 95 % to 5 %; half widths near 1.96 times what rows have."""
    found = identify([coloured(log, seed) for seed in range(logs)], scara(), MODELS.create("explicit"))
    interval = torque_interval(found)
    assert interval.left_out == ("blocks" if logs == 1 else "logs")
    other = Problem((coloured(log, 100),), scara(), found.problem.model, found.problem.chain)
    inside, outside = interval.contained(other, found.X)
    assert (inside > 0.90).all()
    assert inside.mean() < 0.99
    assert outside < 2 * 2 * 0.01  # speeds and torques of two joints


def test_a_faster_motion_lies_outside(log):
    found = identify(log, scara(), MODELS.create("explicit"))
    fast = Problem((MotionLog(1.5 * log.fs, log.q, log.tau, log.torque),), scara(), found.problem.model, found.problem.chain)
    assert torque_interval(found).contained(fast, found.X)[1] > 0.1


@pytest.mark.parametrize("acronym", ["OLS", "WLS", "GLS"])
def test_blocks_are_left_out_as_if_they_had_not_been_logged(log, acronym):
    """Against fits whose rows of the block are taken away: the same weights, so to rounding."""
    found = identify(coloured(log, 1), scara(), MODELS.create("explicit"), estimator=ESTIMATORS.create(acronym))
    (left,) = _left_out(found, found.problem.parts, several=False)
    rows, time = found.independent_rows(), found.rows.time
    block = (time / 2.0).astype(int)
    for k in (0, 7):
        kept = rows[block != k]
        np.testing.assert_allclose(left[k], np.linalg.lstsq(kept[:, :-1], kept[:, -1])[0], rtol=1e-6)


def test_a_level_may_be_asked_for(log):
    found = identify(coloured(log, 1), scara(), MODELS.create("explicit"))
    narrow, wide = (torque_interval(found, level).half for level in (0.5, 0.99))
    assert (narrow < wide).all()


def test_estimators_that_solve_no_rows_have_intervals_of_their_residuals(log):
    found = identify(coloured(log, 1), scara(), MODELS.create("explicit"), estimator=ESTIMATORS.create("ML"))
    assert np.isfinite(torque_interval(found).half).all()
