"""Intervals of torques: they contain the share of held-out torques that they state, and say what lies outside of the fit."""

from dataclasses import replace

import numpy as np
import pytest
import scipy

from idbench.identify import ESTIMATORS, MODELS, MotionLog, Problem, identify, scara
from idbench.identify.estimators.leave_out import Stretches, left_out
from idbench.identify.judge.torque_interval import OTHER_MOTION, torque_interval


def coloured(log, seed, time=0.3, size=(0.5, 0.025)):
    """Return a log with errors of the torques that are correlated over some time."""
    rng, a = np.random.default_rng(seed), np.exp(-1 / (log.fs * time))
    error = scipy.signal.lfilter([np.sqrt(1 - a**2)], [1.0, -a], rng.standard_normal(log.tau.shape), axis=0)
    return replace(log, tau=log.tau + np.array(size) * error)


@pytest.mark.parametrize("logs", [1, 3])
def test_they_contain_at_least_95_percent_of_another_log(log, logs):
    """Errors of 0.3 s on 46 s, some 80 independent ones a joint: 95 % to 5 %; half widths 1.3 times 1.96 of what rows have."""
    found = identify([coloured(log, seed) for seed in range(logs)], scara(), MODELS.create("explicit"))
    interval = torque_interval(found)
    assert interval.band == 10.0
    other = Problem((coloured(log, 100),), scara(), found.problem.model, found.problem.chain)
    inside, outside = interval.contained(other, found.X)
    assert (inside > 0.93).all()
    assert outside < 2 * 2 * 0.01  # speeds and torques of two joints
    alone = interval.half / OTHER_MOTION
    np.testing.assert_allclose(alone, 1.96 * np.array([0.5, 0.025]), rtol=0.25)  # 0.95 to 1.02 of the errors pass 10 Hz


def test_a_faster_motion_lies_outside(log):
    found = identify(log, scara(), MODELS.create("explicit"))
    fast = Problem((MotionLog(1.5 * log.fs, log.q, log.tau, log.torque),), scara(), found.problem.model, found.problem.chain)
    assert torque_interval(found).contained(fast, found.X)[1] > 0.1


@pytest.mark.parametrize("acronym", ["OLS", "WLS", "GLS"])
def test_stretches_are_left_out_as_if_they_had_not_been_logged(log, acronym):
    """Against fits whose rows of the stretch are taken away: the same weights, so to rounding, by both formulas."""
    found = identify(coloured(log, 1), scara(), MODELS.create("explicit"), estimator=ESTIMATORS.create(acronym))
    parts, rows = found.problem.parts, found.independent_rows()
    stretches = Stretches.of(parts)
    without = left_out(stretches.products(parts, [rows]))
    np.testing.assert_allclose(without[-1], found.X, rtol=1e-6)
    for k in (0, 7):
        kept = rows[stretches.at(0, found.rows.time) != k]
        np.testing.assert_allclose(without[k], np.linalg.lstsq(kept[:, :-1], kept[:, -1])[0], rtol=1e-6)
    if acronym == "GLS":  # of rows that are independent both are the same, but for noise in W
        np.testing.assert_allclose(found.X + found.model_error.moved, without[:-1], rtol=1e-3)


def test_what_one_stretch_alone_shows_is_not_known_without_it():
    """A column that is zero but in one stretch: its parameter is zero without it, not rounding over rounding."""
    rng = np.random.default_rng(0)
    rows = rng.standard_normal((5, 40, 3))
    rows[:, :, 1] *= (np.arange(5) == 2)[:, None]
    without = left_out(np.matmul(np.swapaxes(rows, 1, 2), rows))
    assert abs(without[2, 1]) < 1e-3
    kept = np.concatenate(np.delete(rows, 2, axis=0))
    np.testing.assert_allclose(without[2, 0], np.linalg.lstsq(kept[:, :1], kept[:, 2])[0][0], rtol=1e-6)


def test_a_level_may_be_asked_for(log):
    found = identify(coloured(log, 1), scara(), MODELS.create("explicit"))
    narrow, wide = (torque_interval(found, level).half for level in (0.5, 0.99))
    assert (narrow < wide).all()


def test_estimators_that_solve_no_rows_have_intervals_of_their_residuals(log):
    found = identify(coloured(log, 1), scara(), MODELS.create("explicit"), estimator=ESTIMATORS.create("ML"))
    assert np.isfinite(torque_interval(found).half).all()
