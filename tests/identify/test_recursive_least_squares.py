"""Recursive least squares, against least squares of the rows so far."""

import builders
import numpy as np
import pytest

from idbench.identify import (
    CHAINS,
    ESTIMATORS,
    MODELS,
    IdentificationError,
    MotionLog,
    identify,
    recursive_least_squares,
    scara,
)


@pytest.fixture(scope="module")
def noisy(log):
    return builders.noisy(log, 0, 0.1)


@pytest.mark.parametrize("estimator", ["OLS", "WLS", "GLS"])
@pytest.mark.parametrize("model", ["explicit", "power"])
def test_it_is_least_squares_of_the_rows_so_far(noisy, model, estimator):
    """By another route: SciPy-free normal least squares, anew for every instant."""
    estimate = identify(noisy, scara(), MODELS.create(model), estimator=ESTIMATORS.create(estimator))
    t, halo, given, whitened = np.arange(8.0, 47.0, 3.0), 0.7, estimate.rows, estimate.independent_rows()
    W, Y = whitened[:, :-1], whitened[:, -1]
    running = recursive_least_squares(estimate, t, halo)
    _, whole = least_squares(W, Y, given.valid)
    for k, now in enumerate(t):
        X, sigma = least_squares(W, Y, (given.time + halo <= now) & given.valid)
        np.testing.assert_allclose(running.X[k], X, rtol=1e-9)
        np.testing.assert_allclose(running.sigma[k], sigma / whole * estimate.standard_errors, rtol=1e-8)


def least_squares(W, Y, rows):
    X, squares, *_ = np.linalg.lstsq(W[rows], Y[rows], rcond=None)
    return X, np.sqrt(squares[0] / (rows.sum() - 8) * np.diag(np.linalg.inv(W[rows].T @ W[rows])))


def test_it_ends_at_the_estimate(noisy):
    estimate = identify(noisy, scara(), MODELS.create("implicit"), CHAINS.create("paper"))
    running = recursive_least_squares(estimate, np.array([1e9]))
    np.testing.assert_allclose(running.X[-1], estimate.X, rtol=1e-9)
    np.testing.assert_allclose(running.sigma[-1], estimate.standard_errors, rtol=1e-7)


def test_it_is_silent_until_every_parameter_is_told(noisy):
    running = recursive_least_squares(identify(noisy, scara(), MODELS.create("explicit")), np.array([0.0, 1.0, 2.9, 20.0]))
    assert np.isnan(running.X[:3]).all()
    assert np.isnan(running.sigma[:3]).all()
    assert np.isfinite(running.X[3]).all()


def test_it_needs_rows_of_a_single_run(noisy):
    two = MotionLog(noisy.fs, np.stack([noisy.q] * 2), np.stack([noisy.tau] * 2), noisy.torque)
    with pytest.raises(IdentificationError, match="one run"):
        recursive_least_squares(identify(two, scara(), MODELS.create("explicit")), np.array([1.0]))
