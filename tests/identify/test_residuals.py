"""Residuals, instant by instant and by frequency, against closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from builders import noisy

from idbench.identify import (
    CHAINS,
    MODELS,
    MotionLog,
    NoiseLevels,
    NoPrefilter,
    Problem,
    ReversalMask,
    TorqueChannel,
    binned,
    cutoffs,
    filtered,
    idbench_chain,
    instants,
    measured_state,
    noise_spectra,
    scara,
)
from idbench.identify.signals.spectra import welch


@pytest.mark.parametrize("model", MODELS)
def test_the_true_parameters_leave_nothing_over(log, truth, model):
    """A fifth-order move is differentiated exactly, but where the difference looks across the end of a move or a reversal."""
    left = instants(idbench_chain().signals(log), scara(), MODELS.create(model), idbench_chain(), truth)
    scale = np.abs(log.tau).max() * (np.abs(measured_state(log, idbench_chain()).qd).max() if model == "power" else 1.0)
    inside = (left.weight == 1) if model != "power" else np.ones_like(left.weight, dtype=bool)
    assert np.quantile(np.abs(left.residual[inside]), 0.9) < 1e-6 * scale


def test_a_wrong_parameter_leaves_its_column(log, truth):
    """5 % too little Coulomb friction of joint 2 leaves 0.005 N m sign(qd2)."""
    short = truth.copy()
    short[7] *= 0.95
    chain = idbench_chain()
    left = instants(chain.signals(log), scara(), MODELS.create("explicit"), chain, short)
    part = slice(left.first, left.first + left.residual.shape[-1])
    sign, used = np.sign(measured_state(log, chain).qd[1, part]), left.weight[1] == 1
    assert np.median(np.abs(left.residual[1] - 0.005 * sign)[used]) < 1e-8
    edges = np.linspace(-4, 4, 9)
    mean = binned(measured_state(log, chain).qd[1, part], left.residual[1], left.weight[1], edges)
    known = np.isfinite(mean)
    np.testing.assert_allclose(mean[known], 0.005 * np.sign((edges[1:] + edges[:-1]) / 2)[known], rtol=0.2)


def test_bins_hold_weighted_means_and_say_nothing_where_nothing_is():
    x, y, weight = np.array([0.1, 0.2, 0.7, 2.5]), np.array([1.0, 3.0, 5.0, 7.0]), np.array([1.0, 3.0, 1.0, 0.0])
    np.testing.assert_allclose(binned(x, y, weight, np.array([0.0, 0.5, 1.0, 2.0, 3.0])), [2.5, 5.0, np.nan, np.nan])


def test_a_spectrum_has_the_power_of_its_signal():
    """Parseval: the squared density, over all frequencies, is the variance."""
    y = 0.3 * np.sqrt(2) * np.sin(2 * np.pi * 7.0 * np.arange(4000) / 100)
    f, density = welch(y, 100.0, 200)
    assert abs(f[np.argmax(density)] - 7.0) < 1e-9
    np.testing.assert_allclose(np.sum(density) * (f[1] - f[0]), 0.09, rtol=1e-6)


@pytest.mark.parametrize("fs", [100.0, 1000.0])
def test_cutoffs_are_those_of_the_settings(fs):
    """A FIR designed by windows has -6 dB at its cut-off; a Butterworth filter run twice has -6 dB at that of one pass."""
    grain = fs / 8192
    found = cutoffs(CHAINS.create("idbench"), fs)
    assert found["operator"] == pytest.approx(5.0, abs=grain + 0.02)
    assert found["prefilter"] == pytest.approx(15.0, abs=grain + 0.02)
    found = cutoffs(CHAINS.create("paper"), fs)
    assert found["prefilter"] == pytest.approx(8.0, abs=grain + 0.02)
    assert found["operator"] == pytest.approx(4.3, abs=0.1)  # its ripple ends at 4 Hz, by 6 dB it is later


@pytest.mark.parametrize("chain", CHAINS)
def test_slow_motion_passes_the_filters_unchanged(chain):
    t = np.arange(4000) / 100
    q = np.stack([np.sin(0.5 * t), np.cos(0.3 * t)], axis=1)
    log, made = MotionLog(100.0, q, np.zeros_like(q), TorqueChannel("instantaneous")), CHAINS.create(chain)
    seen, rows = filtered(made.signals(log), made), t[made.grid(log).samples]
    np.testing.assert_allclose(seen["q"][0], np.sin(0.5 * rows), atol=2e-3)
    np.testing.assert_allclose(seen["qd"][0], 0.5 * np.cos(0.5 * rows), atol=2e-3)
    np.testing.assert_allclose(seen["qdd"][1], -0.09 * np.cos(0.3 * rows), atol=2e-3)


@pytest.mark.parametrize(("position", "torque"), [(2.8e-5, 0.0), (0.0, 0.05), (2.8e-5, 0.05)])
def test_the_spectra_are_those_of_noise_put_into_a_log(position, torque, log, truth, rng):
    """Between 5 and 40 Hz, in the mean to 10 %: the residual of true parameters, over the instants that are not masked."""
    chain = replace(idbench_chain(), prefilter=NoPrefilter(), mask=ReversalMask(width=0.03, taper=0.1))
    problem = Problem((noisy(log, position, torque, rng=rng),), scara(), MODELS.create("explicit"), chain)
    left = instants(problem.signals[0], scara(), problem.model, chain, truth)
    for joint in (0, 1):
        weight = left.weight[joint]
        f, density = welch(left.residual[joint] * weight, log.fs, round(2 * log.fs))
        seen = np.sqrt(density / np.mean(weight**2))
        levels = NoiseLevels(np.full(2, torque), np.full(2, position))
        predicted = np.hypot(*(each[joint] for each in noise_spectra(problem, levels, f)))
        inside = (f > 5) & (f < 40)
        assert np.exp(np.mean(np.log(seen[inside] / predicted[inside]))) == pytest.approx(1, abs=0.1)
