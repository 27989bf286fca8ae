"""Long logs: the same estimates from triangular factors of pieces as from all rows."""

from dataclasses import replace

import builders
import numpy as np
import pytest
from builders import SOLVED

import idbench.identify.rows.chain
import idbench.identify.rows.rows
from idbench.identify import (
    CHAINS,
    ESTIMATORS,
    MODELS,
    NoMask,
    Problem,
    ReversalMask,
    Rows,
    WeightedLeastSquares,
    idbench_chain,
    identify_each,
    scara,
    validate,
)
from idbench.identify.judge.delay import estimate_delay
from idbench.identify.rows.rows import is_long, manageable


@pytest.fixture
def short(monkeypatch):
    """Logs of more than 1000 samples of two joints count as long, pieces have 500 samples, until what is returned is called."""
    monkeypatch.setattr(idbench.identify.rows.rows, "LONG", 4000)
    monkeypatch.setattr(idbench.identify.rows.chain, "PIECE", 2000)
    return lambda: monkeypatch.setattr(idbench.identify.rows.rows, "LONG", 1e9)


@pytest.fixture
def noisy(log):
    return builders.noisy(log, 0, [0.05, 0.0025])


MODEL = {name: MODELS.create(name) for name in SOLVED}


@pytest.mark.parametrize("estimator", ["OLS", "WLS", "GLS"])
def test_estimates_are_those_of_all_rows(estimator, noisy, short):
    solver = ESTIMATORS.create(estimator)
    assert is_long([noisy])
    cut = identify_each(noisy, scara(), MODEL, estimator=solver)
    short()
    whole = identify_each(noisy, scara(), MODEL, estimator=solver)
    for name, estimate in whole.items():
        found = cut[name]
        assert found.row_count == estimate.row_count
        assert found.condition_number == pytest.approx(estimate.condition_number, rel=1e-9)
        # Power rows are weighted by the noise of eight pieces, as all are by GLS, for which pieces are independent: as good.
        tolerance = 0.2 if (name in ("power", "energy") and estimator == "WLS") or estimator == "GLS" else 1e-6
        assert np.abs((found.X - estimate.X) / estimate.own_sigma).max() < tolerance, name
        np.testing.assert_allclose(found.own_sigma, estimate.own_sigma, rtol=0.1 if tolerance == 0.2 else 1e-6)
        np.testing.assert_allclose(found.residual_rms, estimate.residual_rms, rtol=1e-3)
        np.testing.assert_allclose(found.calibrated_sigma, estimate.calibrated_sigma, rtol=0.3)  # from eight pieces, rows cut


@pytest.mark.parametrize("chain", CHAINS.builtin)
def test_pieces_have_the_rows_of_the_log(chain, noisy, short):
    """All of chain idbench, whose memory ends; those of an IIR filter to what it forgets: 1 %."""
    made, model = CHAINS.create(chain), MODELS.create("implicit")
    made = made if made.mask == NoMask() else replace(made, mask=ReversalMask(0.1))  # whose speeds do not follow a piece
    cut = [noisy.part(*piece) for piece in made.pieces(noisy)]
    short()
    by_piece = Rows.stack([Problem((piece,), scara(), model, made).rows for piece in cut])
    whole = Problem((noisy,), scara(), model, made).rows
    assert by_piece.W.shape == whole.W.shape
    scale = np.abs(whole.W).max(axis=0)
    np.testing.assert_allclose(by_piece.W / scale, whole.W / scale, atol=1e-9 if chain == "idbench" else 0.05)


def test_a_trim_of_its_own_is_kept(noisy, short):
    made = replace(idbench_chain(), trim=3.0)
    cut = Problem((noisy,), scara(), MODELS.create("explicit"), made).factors
    short()
    whole = Problem((noisy,), scara(), MODELS.create("explicit"), made).factors
    np.testing.assert_array_equal(cut.rows, whole.rows)
    squares, expected = (np.swapaxes(factors.R, -1, -2) @ factors.R for factors in (cut, whole))
    np.testing.assert_allclose(squares, expected, atol=1e-9 * np.abs(expected).max())


def test_a_fit_of_several_long_logs_is_that_of_all_their_rows(noisy, short):
    parts = [noisy.part(0, 2400), noisy.part(2200, 4600)]
    weighted = WeightedLeastSquares()  # GLS takes pieces for independent
    cut = identify_each(parts, scara(), MODEL, estimator=weighted)
    short()
    whole = identify_each(parts, scara(), MODEL, estimator=weighted)
    for name in ("explicit", "implicit"):
        assert cut[name].row_count == whole[name].row_count
        np.testing.assert_allclose(cut[name].X, whole[name].X, rtol=1e-9)


def test_what_needs_rows_takes_the_beginning_of_a_long_log(noisy, truth, monkeypatch):
    monkeypatch.setattr(idbench.identify.rows.rows, "LONG", 4 * 2000)
    beginning = noisy.part(0, 2000)
    assert estimate_delay(noisy, scara()).delay == estimate_delay(beginning, scara()).delay
    judged = (
        Problem((log,), scara(), MODELS.create("explicit"), idbench_chain()) for log in (manageable([noisy])[0], beginning)
    )
    one, two = (validate(problem, truth) for problem in judged)
    np.testing.assert_array_equal(one.rms, two.rms)
