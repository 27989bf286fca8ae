"""Least squares and its uncertainty against NumPy, and against the scatter of many runs."""

from dataclasses import dataclass

import numpy as np
import pytest

from idbench.identify import Estimate, ExcitationError, IdentificationError, LogError, OrdinaryLeastSquares, Rows, Status
from idbench.identify.rows.factors import Factors

NAMES = ("a", "b", "c")


def rows(W, Y, valid=None):
    r = Y.shape[-1]
    valid = np.ones(Y.shape, dtype=bool) if valid is None else valid
    return Rows(Y, W, valid, np.arange(r) / 10, 1, NAMES, ())


def factor(*args):
    return rows(*args).factors.together


@dataclass(frozen=True)
class Given:
    """A problem of which only rows are known."""

    rows: Rows
    names = NAMES

    @property
    def factors(self):
        return self.rows.factors


def fit(*args):
    return OrdinaryLeastSquares().solve(Given(rows(*args)))


def test_estimate_and_covariance_are_the_textbooks(rng):
    W, Y = rng.normal(size=(200, 3)), rng.normal(size=200)
    estimate = fit(W, Y)
    X, squares, _, values = np.linalg.lstsq(W, Y, rcond=None)
    np.testing.assert_allclose(estimate.X, X, rtol=1e-12)
    np.testing.assert_allclose(estimate.own_covariance, squares[0] / 197 * np.linalg.inv(W.T @ W), rtol=1e-10)
    np.testing.assert_allclose(estimate.paper_sigma_percent, 100 * estimate.own_sigma / np.abs(X), rtol=1e-12)
    np.testing.assert_allclose(estimate.residual, Y - W @ X, atol=1e-12)
    assert estimate.condition_number == pytest.approx(values[0] / values[-1], rel=1e-12)
    assert estimate.residual_rms == pytest.approx(np.sqrt(np.mean((Y - W @ X) ** 2)), rel=1e-12)
    assert estimate.row_count == 200
    assert estimate.problem.factors.together.rank == 3


def test_sigma_is_the_scatter_of_the_estimate_when_the_papers_assumptions_hold(rng):
    """White residuals, exact W: over 4000 runs the standard deviation is known to 1/sqrt(8000) = 1.1 %; allow 4 of those."""
    W, truth = rng.normal(size=(60, 3)) * [1, 10, 0.1], np.array([1.0, -2.0, 3.0])
    Y = W @ truth + 0.3 * rng.normal(size=(4000, 60))
    estimates = fit(np.broadcast_to(W, (4000, 60, 3)), Y)
    expected = np.sqrt(np.mean(estimates.own_sigma**2, axis=0))
    np.testing.assert_allclose(estimates.X.std(axis=0), expected, rtol=0.045)


def test_void_rows_do_not_count(rng):
    W, Y = rng.normal(size=(50, 3)), rng.normal(size=50)
    valid = np.arange(50) < 40
    short, padded = fit(W[:40], Y[:40]), fit(W * valid[:, None], Y * valid, valid)
    np.testing.assert_allclose(padded.X, short.X, rtol=1e-12)
    np.testing.assert_allclose(padded.own_sigma, short.own_sigma, rtol=1e-12)
    assert padded.row_count == 40
    assert padded.residual_rms == pytest.approx(float(short.residual_rms), rel=1e-12)


def test_a_direction_that_is_not_seen_is_named(rng):
    W = rng.normal(size=(50, 3))
    W[:, 2] = 5 * W[:, 0]  # a and c only appear together
    deficient = factor(W, rng.normal(size=50))
    assert deficient.status == Status.RANK_DEFICIENT
    assert deficient.not_shown() == ("a", "c")
    with pytest.raises(ExcitationError, match="does not excite a, c: W has rank 2 of 3"):
        deficient.check()
    assert np.isnan(deficient.solution(deficient.status == Status.OK)).all()


def test_a_column_of_zeros_is_named(rng):
    W = rng.normal(size=(50, 3))
    W[:, 1] = 0
    assert factor(W, np.zeros(50)).not_shown() == ("b",)
    assert factor(W, np.zeros(50)).condition_number == np.inf


def test_scales_of_parameters_do_not_make_rows_deficient(rng):
    W = rng.normal(size=(50, 3)) * [1e-9, 1, 1e9]
    assert factor(W, np.zeros(50)).status == Status.OK


def test_too_few_rows_are_refused(rng):
    with pytest.raises(IdentificationError, match="3 rows are left by the mask for 3 parameters"):
        factor(rng.normal(size=(3, 3)), np.zeros(3)).check()
    with pytest.raises(IdentificationError, match="2 rows are left"):
        factor(rng.normal(size=(2, 3)), np.zeros(2)).check()


def test_a_failed_run_does_not_touch_the_others(rng):
    W, Y = rng.normal(size=(3, 50, 3)), rng.normal(size=(3, 50))
    W[1, :, 2] = W[1, :, 0]
    together = fit(W, Y)
    assert list(together.status) == [Status.OK, Status.RANK_DEFICIENT, Status.OK]
    assert np.isnan(together.X[1]).all()
    for run in (0, 2):
        np.testing.assert_array_equal(together.X[run], fit(W[run], Y[run]).X)
        np.testing.assert_array_equal(together.own_sigma[run], fit(W[run], Y[run]).own_sigma)
    with pytest.raises(ExcitationError, match=r"\(run \(1,\), and 0 more\)"):
        together.problem.factors.together.check()


def test_stacked_rows_are_one_fit(rng):
    W, Y = rng.normal(size=(90, 3)), rng.normal(size=90)
    stacked = Rows.stack([rows(W[:50], Y[:50]), rows(W[50:], Y[50:])])
    np.testing.assert_array_equal(stacked.W, W)
    assert stacked.count == [90]
    with pytest.raises(LogError, match="same parameters"):
        Rows.stack([stacked, rows(W[None], Y[None])])


def test_factors_of_pieces_are_those_of_all_rows(rng):
    W, Y = rng.normal(size=(90, 3)), rng.normal(size=90)
    whole, parts = rows(W, Y).factors, [rows(W[k : k + 30], Y[k : k + 30]).factors for k in (0, 30, 60)]
    merged = Factors.merged(parts)
    np.testing.assert_allclose(np.abs(merged.R), np.abs(whole.R), atol=1e-12)
    np.testing.assert_array_equal(merged.rows, whole.rows)


def test_two_kinds_are_weighted_each_by_its_residuals(rng):
    """By another route: rows divided by the rms of their kind's residuals, solved by NumPy."""
    W, Y = rng.normal(size=(200, 3)), rng.normal(size=200) * np.tile([1.0, 5.0], 100)
    found = Rows(Y, W, np.ones(200, dtype=bool), np.repeat(np.arange(100), 2) / 10, 2, NAMES, ()).factors.fit(2)
    weight = np.ones(200)
    for _ in range(3):
        X = np.linalg.lstsq(W * weight[:, None], Y * weight, rcond=None)[0]
        weight = np.tile([1 / np.sqrt(np.mean((Y - W @ X)[k::2] ** 2)) for k in (0, 1)], 100)
    np.testing.assert_allclose(found.X, X, rtol=1e-10)


def test_an_estimator_may_bring_its_own_covariance(rng):
    one = Given(rows(rng.normal(size=(50, 3)), rng.normal(size=50)))
    estimate = Estimate.judge(one, np.array([1.0, 2.0, -4.0]), np.diag([1.0, 4.0, 16.0]))
    np.testing.assert_array_equal(estimate.own_sigma, [1, 2, 4])
    np.testing.assert_array_equal(estimate.paper_sigma_percent, [100, 100, 100])
    np.testing.assert_array_equal(estimate.relative_error_percent([2.0, 2.0, -2.0]), [50, 0, 100])


@pytest.mark.parametrize(("apart", "status"), [(1e-8, Status.RANK_DEFICIENT), (1e-4, Status.OK)])
def test_directions_count_as_unseen_at_the_level_of_the_columns_own_errors(apart, status, rng):
    W = rng.normal(size=(50, 3))
    W[:, 2] = W[:, 0] + apart * W[:, 2]
    assert factor(W, np.zeros(50)).status == status
