"""Least squares and its uncertainty against NumPy, and against the scatter of many runs."""

import numpy as np
import pytest

from identify import Estimate, ExcitationError, IdentificationError, LogError, OrdinaryLeastSquares, Problem, Status, System

NAMES = ("a", "b", "c")


def system(W, Y, valid=None):
    r = Y.shape[-1]
    valid = np.ones(Y.shape, dtype=bool) if valid is None else valid
    return System(Y, W, np.ones(Y.shape), valid, np.arange(r) / 10, np.zeros(r, dtype=np.intp), NAMES)


def fit(*args):
    return OrdinaryLeastSquares().fit(Problem(system(*args)))


def test_estimate_and_covariance_are_the_textbooks(rng):
    W, Y = rng.normal(size=(200, 3)), rng.normal(size=200)
    estimate = fit(W, Y)
    X, squares, _, values = np.linalg.lstsq(W, Y, rcond=None)
    np.testing.assert_allclose(estimate.X, X, rtol=1e-12)
    np.testing.assert_allclose(estimate.covariance, squares[0] / 197 * np.linalg.inv(W.T @ W), rtol=1e-10)
    np.testing.assert_allclose(estimate.relative_sigma_percent, 100 * estimate.sigma / np.abs(X), rtol=1e-12)
    np.testing.assert_allclose(estimate.residual, Y - W @ X, atol=1e-12)
    assert estimate.condition_number == pytest.approx(values[0] / values[-1], rel=1e-12)
    assert estimate.residual_rms == pytest.approx(np.sqrt(np.mean((Y - W @ X) ** 2)), rel=1e-12)
    assert estimate.rows == 200
    assert estimate.system.rank == 3


def test_sigma_is_the_scatter_of_the_estimate_when_the_papers_assumptions_hold(rng):
    """White residuals, exact W: over 4000 runs the standard deviation is known to 1/sqrt(8000) = 1.1 %; allow 4 of those."""
    W, truth = rng.normal(size=(60, 3)) * [1, 10, 0.1], np.array([1.0, -2.0, 3.0])
    Y = W @ truth + 0.3 * rng.normal(size=(4000, 60))
    estimates = fit(np.broadcast_to(W, (4000, 60, 3)), Y)
    expected = np.sqrt(np.mean(estimates.sigma**2, axis=0))
    np.testing.assert_allclose(estimates.X.std(axis=0), expected, rtol=0.045)


def test_void_rows_do_not_count(rng):
    W, Y = rng.normal(size=(50, 3)), rng.normal(size=50)
    valid = np.arange(50) < 40
    short, padded = fit(W[:40], Y[:40]), fit(W * valid[:, None], Y * valid, valid)
    np.testing.assert_allclose(padded.X, short.X, rtol=1e-12)
    np.testing.assert_allclose(padded.sigma, short.sigma, rtol=1e-12)
    assert padded.rows == 40
    assert padded.residual_rms == pytest.approx(float(short.residual_rms), rel=1e-12)


def test_a_direction_that_is_not_seen_is_named(rng):
    W = rng.normal(size=(50, 3))
    W[:, 2] = 5 * W[:, 0]  # a and c only appear together
    deficient = system(W, rng.normal(size=50))
    assert deficient.status == Status.RANK_DEFICIENT
    assert deficient.unseen() == ("a", "c")
    with pytest.raises(ExcitationError, match="does not show a, c: W has rank 2 of 3"):
        deficient.check()
    assert np.isnan(OrdinaryLeastSquares().fit(Problem(deficient)).X).all()


def test_a_column_of_zeros_is_named(rng):
    W = rng.normal(size=(50, 3))
    W[:, 1] = 0
    assert system(W, np.zeros(50)).unseen() == ("b",)
    assert system(W, np.zeros(50)).condition_number == np.inf


def test_scales_of_parameters_do_not_make_a_system_deficient(rng):
    W = rng.normal(size=(50, 3)) * [1e-9, 1, 1e9]
    assert system(W, np.zeros(50)).status == Status.OK


def test_too_few_rows_are_refused(rng):
    with pytest.raises(IdentificationError, match="3 rows of 3 are left by the mask for 3 parameters"):
        system(rng.normal(size=(3, 3)), np.zeros(3)).check()
    with pytest.raises(IdentificationError, match="2 rows of 2 are left"):
        system(rng.normal(size=(2, 3)), np.zeros(2)).check()


def test_a_failed_run_does_not_touch_the_others(rng):
    W, Y = rng.normal(size=(3, 50, 3)), rng.normal(size=(3, 50))
    W[1, :, 2] = W[1, :, 0]
    together = fit(W, Y)
    assert list(together.system.status) == [Status.OK, Status.RANK_DEFICIENT, Status.OK]
    assert np.isnan(together.X[1]).all()
    for run in (0, 2):
        np.testing.assert_array_equal(together.X[run], fit(W[run], Y[run]).X)
        np.testing.assert_array_equal(together.sigma[run], fit(W[run], Y[run]).sigma)
    with pytest.raises(ExcitationError, match=r"\(run \(1,\), and 0 more\)"):
        together.system.check()


def test_stacked_systems_are_one_fit(rng):
    W, Y = rng.normal(size=(90, 3)), rng.normal(size=90)
    stacked = System.stack([system(W[:50], Y[:50]), system(W[50:], Y[50:])])
    np.testing.assert_array_equal(stacked.W, W)
    assert stacked.rows == 90
    with pytest.raises(LogError, match="no log"):
        System.stack([])
    with pytest.raises(LogError, match="same parameters"):
        System.stack([stacked, system(W[None], Y[None])])


def test_an_estimator_may_bring_its_own_covariance(rng):
    one = system(rng.normal(size=(50, 3)), rng.normal(size=50))
    estimate = Estimate.judge(one, np.array([1.0, 2.0, -4.0]), np.diag([1.0, 4.0, 16.0]))
    np.testing.assert_array_equal(estimate.sigma, [1, 2, 4])
    np.testing.assert_array_equal(estimate.relative_sigma_percent, [100, 100, 100])
    np.testing.assert_array_equal(estimate.relative_error_percent([2.0, 2.0, -2.0]), [50, 0, 100])


def test_an_estimate_prints_its_numbers(rng):
    estimate = fit(rng.normal(size=(50, 3)), rng.normal(size=50))
    printed = str(estimate).splitlines()
    assert printed[0].split() == ["X", "sigma", "%sigma"]
    assert [line.split()[0] for line in printed[1:4]] == list(NAMES)
    assert float(printed[1].split()[1]) == pytest.approx(estimate.X[0], rel=1e-4)
    assert "50 rows" in printed[-1]
    assert str(fit(rng.normal(size=(4, 50, 3)), rng.normal(size=(4, 50)))) == "estimates of a, b, c in (4,) runs"


@pytest.mark.parametrize(("apart", "status"), [(1e-8, Status.RANK_DEFICIENT), (1e-4, Status.OK)])
def test_directions_count_as_unseen_at_the_level_of_the_columns_own_errors(apart, status, rng):
    W = rng.normal(size=(50, 3))
    W[:, 2] = W[:, 0] + apart * W[:, 2]
    assert system(W, np.zeros(50)).status == status
