"""Generalized least squares, and the noise levels that it finds."""

from dataclasses import replace

import numpy as np
import pytest
from builders import SOLVED, dense, noisy

from idbench.identify import (
    CHAINS,
    MODELS,
    OPERATORS,
    GeneralizedLeastSquares,
    NoPrefilter,
    Problem,
    WeightedLeastSquares,
    attempt_each,
    idbench_chain,
    identify,
    identify_each,
    scara,
)
from idbench.identify.noise.band_matrix import BandMatrix, Cholesky
from idbench.identify.noise.propagation import NoiseLevels, NoisyRows
from idbench.identify.noise.restricted_likelihood import _Slope, likely_levels
from idbench.identify.noise.row_weights import unbiased, with_more_noise
from idbench.identify.rows import chain, rows

EVERY = {name: MODELS.create(name) for name in SOLVED}
GLS = GeneralizedLeastSquares()
BITS16 = 2 * np.pi / 2**16 / np.sqrt(12)


@pytest.fixture
def whitened(log):
    """Return the rows of an implicit problem with their whitening, and their covariance as a matrix."""
    problem = Problem((log,), scara(), EVERY["implicit"], idbench_chain())
    rows = NoisyRows(problem.rows.maps[0], problem.parts[0].linear)
    levels = NoiseLevels(np.array([0.1, 0.01]), np.full(2, 1e-4))
    return problem.rows, rows.whitening(levels), dense(rows.covariance(levels))


def test_band_algebra_is_that_of_the_whole_matrix(whitened, rng):
    """Products, solutions, and the trace of an inverse times the matrix: the number of its rows."""
    rows, whitening, C = whitened
    kept = np.flatnonzero(whitening.kept)
    C, x = C[np.ix_(kept, kept)], rng.standard_normal((len(rows.Y), 3))
    np.testing.assert_allclose(whitening.solve(x)[kept], np.linalg.solve(C, x[kept]), rtol=1e-6, atol=1e-9)
    z = whitening.whiten(x)
    np.testing.assert_allclose(z.T @ z, x[kept].T @ np.linalg.solve(C, x[kept]), rtol=1e-9)
    band = whitening.C
    np.testing.assert_allclose((band @ (x * whitening.kept[:, None]))[kept], C @ x[kept], rtol=1e-9, atol=1e-15)
    assert Cholesky.of(band).inverse().trace_with(band) == pytest.approx(len(kept))


@pytest.mark.parametrize("model", EVERY)
def test_it_solves_the_normal_equations_with_the_covariance_of_the_rows(model, log):
    """G' Y = X, and G' W = 1 but for what noise adds to W; its covariance is that of the noise through G, by dense matrices."""
    found = identify(noisy(log, BITS16, (0.02, 0.001), (1,), 11), scara(), EVERY[model], estimator=GLS)
    rows, G = found.rows, found.influence()[0]
    np.testing.assert_allclose(G.T @ rows.W[0], np.eye(8), atol=1e-3)
    np.testing.assert_allclose(G.T @ rows.Y[0], found.X[0], rtol=1e-6)
    if model not in ("power", "energy"):  # whose rows have noise of their own
        C = found.problem.parts[0].noisy.covariance(found.problem.likely_noise)
        C = dense(replace(C, bands=C.bands[0]))
        np.testing.assert_allclose(np.diag(G.T @ C @ G), found.own_sigma[0] ** 2, rtol=1e-6)


@pytest.mark.thorough
@pytest.mark.parametrize("torque", [(0.0, 0.0), (0.02, 0.001), (0.1, 0.005)])
def test_levels_are_found(torque, log):
    """Squares of positions to 5 %, and to what the draws scatter, which is much where torque noise hides them; torques to 5 %,
    or below 0.001 and 5e-5 N m where there is none.
    """
    problem = Problem((noisy(log, BITS16, torque, (100,), 11),), scara(), EVERY["power"], idbench_chain())
    levels = problem.likely_noise
    squares = levels.position**2 / BITS16**2
    standard_error = np.std(squares, axis=0) / np.sqrt(len(squares))
    assert (np.abs(np.mean(squares, axis=0) - 1) < 0.05 + 3 * standard_error).all()
    rms = np.sqrt(np.mean(levels.torque**2, axis=0))
    if torque[0]:
        np.testing.assert_allclose(rms, torque, rtol=0.05)
    else:
        assert (rms < (1e-3, 5e-5)).all()


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("position", "torque", "most"),
    [(BITS16, (0.0, 0.0), 0.25), (BITS16, (0.1, 0.1), 1.02), (0.0, (0.1, 0.005), 1.02)],
)
def test_errors_against_weighted_least_squares(position, torque, most, log, truth):
    """Typical error over 100 draws, and sigma within a quarter, for the models whose rows are torques."""
    draws = noisy(log, position, torque, (100,), 11)
    models = {name: EVERY[name] for name in ("explicit", "implicit")}
    weighted, general = (
        identify_each(draws, scara(), models, **how) for how in ({"estimator": WeightedLeastSquares()}, {"estimator": GLS})
    )
    for name, found in general.items():
        error, other = (np.sqrt(np.mean((each.X - truth) ** 2, axis=0)) for each in (found, weighted[name]))
        assert np.exp(np.mean(np.log(error / other))) < most
        assert np.sqrt(np.mean(((found.X - truth) / found.calibrated_sigma) ** 2)) == pytest.approx(1, abs=0.25)
        np.testing.assert_allclose(found.own_sigma, found.calibrated_sigma, rtol=0.3)  # one noise is less than the other


def test_no_noise_is_put_in_where_a_joint_stands(log):
    """Of |qd|, which power has, noise would make friction where none is."""
    problem = Problem((log,), scara(), EVERY["power"], idbench_chain())
    rows = problem.rows
    moves = np.abs(np.gradient(log.q, axis=-2)).max(axis=(-3, -1) if log.q.ndim > 2 else -1) > 0
    near = np.array([moves[(log.t > t - 1) & (log.t < t + 1)].any() for t in rows.time])
    better = unbiased(
        rows, problem.chain.rows(with_more_noise(problem.signals[0], np.full(2, 1e-4)), problem.basis, problem.model)
    )
    assert np.count_nonzero(~near) > 5
    np.testing.assert_allclose(better.W[..., ~near, :], rows.W[..., ~near, :], atol=1e-12)
    assert np.abs(better.W - rows.W).max() > 1e-6


@pytest.mark.thorough
@pytest.mark.parametrize("operator", OPERATORS.builtin)
def test_every_operator_has_a_covariance_to_solve_with(operator, log, truth):
    chain = (
        CHAINS.create("unfiltered") if operator == "samples" else replace(idbench_chain(), operator=OPERATORS.create(operator))
    )
    found = identify(noisy(log, BITS16, (0.01, 0.001), (20,), 11), scara(), EVERY["explicit"], chain, GLS)
    assert np.sqrt(np.mean(((found.X - truth) / found.own_sigma) ** 2)) < 1.5


def test_a_log_without_any_noise_is_solved(log, truth):
    """Levels end at their least; nothing is singular."""
    found = identify(log, scara(), EVERY["explicit"], estimator=GLS)
    np.testing.assert_allclose(found.X, truth, rtol=1e-3)
    assert np.isfinite(found.own_sigma).all()


def test_two_logs_are_worth_two_and_long_ones_come_in_pieces(log, monkeypatch):
    single = noisy(log, BITS16, (0.1, 0.005), rng=11)
    sigma = identify(single, scara(), EVERY["explicit"], estimator=GLS).own_sigma
    double = identify([single, single], scara(), EVERY["explicit"], estimator=GLS)
    np.testing.assert_allclose(np.sqrt(2) * double.own_sigma, sigma, rtol=0.1)
    monkeypatch.setattr(rows, "LONG", 1e4)
    monkeypatch.setattr(chain, "PIECE", 4e3)
    pieces = identify(single, scara(), EVERY["explicit"], estimator=GLS)
    assert pieces.problem.long
    np.testing.assert_allclose(pieces.own_sigma, sigma, rtol=0.25)
    assert (np.abs(pieces.X - double.X) < 3 * sigma).all()


@pytest.mark.parametrize("share", [0.0, 0.5, 2.0])
def test_levels_do_not_depend_on_where_they_begin(share, log):
    """At nothing, at half or at twice what they are: to 3 %, as five rounds leave it."""
    problem = Problem((noisy(log, BITS16, (0.1, 0.005), (4,), 11),), scara(), EVERY["explicit"], idbench_chain())
    start = NoiseLevels(np.tile([share * 0.1, share * 0.005], (4, 1)), np.full((4, 2), BITS16))
    (part,) = problem.parts
    found = likely_levels([part.unbiased], [part.noisy], start)
    np.testing.assert_allclose(found.torque, problem.likely_noise.torque, rtol=0.03)


@pytest.mark.thorough
def test_what_noise_adds_to_W_is_taken_from_it(log, truth):
    """12 bits, not filtered: squares of noisy velocities are too large on average, which sigma does not know.

    Means of 100 draws are known to a tenth of a sigma; with W as it is, some are off by more than one.
    """
    chain = replace(idbench_chain(), prefilter=NoPrefilter())
    found = identify(noisy(log, 16 * BITS16, (0.0, 0.0), (100,), 11), scara(), EVERY["explicit"], chain, GLS)
    assert np.abs(np.mean((found.X - truth) / found.own_sigma, axis=0)).max() < 0.5
    problem, whole = found.problem, found.rows
    whitening = problem.parts[0].whitening
    solved = np.swapaxes(whitening.solve(whole.W), -1, -2)
    plain = np.linalg.solve(solved @ whole.W, solved @ whole.Y[..., None])[..., 0]
    assert np.abs(np.mean((plain - truth) / found.own_sigma, axis=0)).max() > 1


def test_rows_of_one_model_that_are_too_few_leave_the_others(log):
    """Of a short log: the power model's rows do not determine its parameters, the explicit model's do."""
    short = noisy(log, BITS16, (0.01, 0.001), rng=11).part(900, 1080)
    found = attempt_each(Problem((short,), scara(), EVERY["explicit"], idbench_chain()), EVERY, GLS, throw=False)
    assert np.isfinite(found["explicit"].X).all()
    assert np.isnan(found["power"].X).all()


def test_one_run_without_a_covariance_leaves_the_others():
    root = Cholesky.of(BandMatrix(np.array([[[4.0]] * 3, [[-1.0]] * 3])))
    np.testing.assert_array_equal(root.lower[0], [[2.0]] * 3)
    assert np.isnan(root.lower[1]).all()


def test_levels_that_show_nowhere_do_not_end_the_search():
    """Average information of a level without effect is zero: no Newton step divides by it."""
    slope = _Slope(np.array([2.0, 0.0]), np.array([1.0, 1e-300]), np.diag([4.0, 0.0]), np.zeros((1, 2)))
    step = slope.newton(np.ones(2), np.zeros(2))
    assert np.isfinite(step).all()
    assert step[0] > 1
