"""Long logs: the same estimates from triangular factors of pieces as from all rows."""

from dataclasses import replace

import numpy as np
import pytest

import identify.long
from identify import (
    CHAINS,
    ESTIMATORS,
    MODELS,
    MotionLog,
    System,
    TorqueChannel,
    idbench_chain,
    identify_each,
    scara,
    validate,
)
from identify.compression import compressed
from identify.delay import estimate_delay
from identify.long import build_long, is_long, spans


@pytest.fixture
def short(monkeypatch):
    """Logs of more than 1000 samples of two joints count as long, pieces have 250 samples."""
    monkeypatch.setattr(identify.long, "LONG", 4000)
    monkeypatch.setattr(identify.long, "PIECE", 1000)


@pytest.fixture
def noisy(log, rng):
    tau = log.tau + [0.05, 0.0025] * rng.standard_normal(log.tau.shape)
    return MotionLog(log.fs, log.q, tau, TorqueChannel("instantaneous"))


MODEL = {name: MODELS.create(name) for name in MODELS.builtin}


@pytest.mark.parametrize("estimator", ESTIMATORS.builtin)
def test_estimates_are_those_of_all_rows(estimator, noisy, short, monkeypatch):
    solver = ESTIMATORS.create(estimator)
    assert is_long(noisy)
    cut = identify_each(noisy, scara(), MODEL, estimator=solver)
    monkeypatch.setattr(identify.long, "LONG", 1e9)
    whole = identify_each(noisy, scara(), MODEL, estimator=solver)
    for name, estimate in whole.items():
        found = cut[name]
        assert found.rows == estimate.rows
        assert found.condition_number == pytest.approx(estimate.condition_number, rel=1e-9)
        # Power rows are weighted in steps of 5 % of their noise: other weights, as good.
        tolerance = 0.1 if (name, estimator) == ("power", "WLS") else 1e-6
        assert np.abs((found.X - estimate.X) / estimate.sigma).max() < tolerance, name
        np.testing.assert_allclose(found.sigma, estimate.sigma, rtol=0.01 if tolerance == 0.1 else 1e-6)
        np.testing.assert_allclose(found.residual_rms, estimate.residual_rms, rtol=1e-3)
        np.testing.assert_allclose(found.corrected_sigma, estimate.corrected_sigma, rtol=0.3)  # from eight pieces, rows cut


@pytest.mark.parametrize("chain", CHAINS.builtin)
def test_pieces_have_the_rows_of_the_log(chain, noisy, short, monkeypatch):
    """All of chain idbench, whose memory ends; those of an IIR filter to what it forgets: 1 %."""
    made, model = CHAINS.create(chain), MODELS.create("implicit")
    pieces = [one.part(first, end) for one, first, end in spans(made, noisy)]
    by_piece = System.stack([replace(made, trim=None).build(piece, scara(), model) for piece in pieces])
    whole = made.build(noisy, scara(), model)
    assert by_piece.W.shape == whole.W.shape
    scale = np.abs(whole.W).max(axis=0)
    np.testing.assert_allclose(by_piece.W / scale, whole.W / scale, atol=1e-9 if chain == "idbench" else 0.05)


def test_a_trim_of_its_own_is_kept(noisy, short, monkeypatch):
    made = replace(idbench_chain(), trim=3.0)
    (cut,) = build_long(made, noisy, scara(), [MODELS.create("explicit")])
    whole = made.build(noisy, scara(), MODELS.create("explicit"))
    assert cut.rows == whole.rows
    np.testing.assert_allclose(np.abs(np.diagonal(cut.R)), np.abs(np.diagonal(whole.R)), rtol=1e-9)


def test_compressing_keeps_what_least_squares_needs(noisy):
    system = idbench_chain().build(noisy, scara(), MODELS.create("explicit"))
    small = compressed(system)
    assert len(small.Y) <= 2 * 9
    assert small.rows == system.rows
    for group in (0, 1):
        mine, theirs = ((s.W[s.group == group], s.Y[s.group == group]) for s in (small, system))
        np.testing.assert_allclose(mine[0].T @ mine[0], theirs[0].T @ theirs[0], rtol=1e-9)
        np.testing.assert_allclose(mine[0].T @ mine[1], theirs[0].T @ theirs[1], rtol=1e-9)
    again = compressed(System.stack([small, system]))
    assert again.rows == 2 * system.rows


def test_a_fit_of_several_long_logs_is_that_of_all_their_rows(noisy, short, monkeypatch):
    parts = [noisy.part(0, 2400), noisy.part(2200, 4600)]
    cut = identify_each(parts, scara(), MODEL)
    monkeypatch.setattr(identify.long, "LONG", 1e9)
    whole = identify_each(parts, scara(), MODEL)
    for name in ("explicit", "implicit"):
        assert cut[name].rows == whole[name].rows
        np.testing.assert_allclose(cut[name].X, whole[name].X, rtol=1e-9)


def test_what_needs_rows_takes_the_beginning_of_a_long_log(noisy, truth, monkeypatch):
    monkeypatch.setattr(identify.long, "LONG", 4 * 2000)
    beginning = noisy.part(0, 2000)
    assert estimate_delay(noisy, scara()).delay == estimate_delay(beginning, scara()).delay
    one, two = (validate(log, scara(), truth, idbench_chain()) for log in (noisy, beginning))
    np.testing.assert_array_equal(one.rms, two.rms)
