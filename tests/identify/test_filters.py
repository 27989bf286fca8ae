"""Filters against the closed forms of their gain, and windows that are exact for polynomials."""

import numpy as np
import pytest
from scipy.special import eval_chebyt

from idbench.identify import ButterworthPrefilter, CentralDifference, FirLowPass, IirLowPass
from idbench.identify.rows.row_map import Grid
from idbench.identify.signals.filters import averaged, shift

FS = 100.0
T = np.arange(4000) / FS
MIDDLE = slice(1500, 2500)


def gain_and_phase(y, f):
    """Return the complex gain of a sine of frequency f [Hz] in the middle of y."""
    t = T[MIDDLE]
    c, s = np.linalg.lstsq(np.stack([np.cos(2 * np.pi * f * t), np.sin(2 * np.pi * f * t)], axis=-1), y[MIDDLE], rcond=None)[0]
    return complex(s, c)


def warped(f):
    """The analogue frequency that the bilinear transform maps f to."""
    return np.tan(np.pi * f / FS)


@pytest.mark.parametrize("f", [1.0, 4.0, 8.0, 12.0])
def test_butterworth_forward_backward_has_its_gain_squared_and_no_phase(f):
    expected = 1 / (1 + (warped(f) / warped(8.0)) ** 8)  # |H|^2 of order 4
    out = ButterworthPrefilter(8.0, order=4).apply(np.sin(2 * np.pi * f * T), FS)
    assert gain_and_phase(out, f) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("f", [0.5, 2.0, 4.0, 4.5, 5.0])
def test_iir_low_pass_is_matlabs_chebyshev_forward_backward(f):
    epsilon_squared = 10 ** (0.05 / 10) - 1
    expected = 1 / (1 + epsilon_squared * eval_chebyt(8, warped(f) / warped(4.0)) ** 2)
    out = IirLowPass(4.0).window(FS, Grid(0, 1, 4000)).apply(np.sin(2 * np.pi * f * T))
    assert gain_and_phase(out, f) == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("fs", [100.0, 250.0, 1000.0])
@pytest.mark.parametrize(
    ("f", "low", "high"), [(0.0, 0.9999, 1.0001), (2.4, 0.996, 1.004), (5.0, 0.49, 0.51), (7.7, -0.004, 0.004)]
)
def test_fir_low_pass_has_its_cutoff_and_transition_in_hertz(fs, f, low, high):
    """Flat to -50 dB below cutoff - transition/2, half at the cut-off, below -50 dB above, whatever fs."""
    t = np.arange(int(10 * fs)) / fs
    out = FirLowPass(5.0, 5.0).window(fs, Grid(int(5 * fs), 1, 1)).apply(np.cos(2 * np.pi * f * (t - 5.0)))
    assert low < out[0] < high


@pytest.mark.parametrize(
    ("operator", "fs", "step"),
    [(FirLowPass(5.0), 100, 10), (FirLowPass(5.0), 1000, 100), (IirLowPass(4.0), 100, 10), (IirLowPass(4.0), 1000, 100)],
)
def test_decimation_follows_the_papers_rules(operator, fs, step):
    """n_d = (fs/2)/f_fp for FIR, 0.8 (fs/2)/f_fp for IIR (section 6.2)."""
    assert operator.step(fs) == step


SLOW = 50.0
SHORT = np.arange(40) / SLOW
INNER = slice(8, -8)


def polynomial(rng, degree):
    return np.polynomial.Polynomial(rng.normal(size=degree + 1))


@pytest.mark.parametrize("order", [2, 6])
def test_central_differences_are_exact_to_their_order(order, rng):
    p = polynomial(rng, order)
    derivative = CentralDifference(order).derivative(p(SHORT), SLOW)
    np.testing.assert_allclose(derivative[INNER], p.deriv()(SHORT)[INNER], atol=1e-11)


@pytest.mark.parametrize(("order", "droop"), [(2, lambda x: x**2 / 6), (6, lambda x: x**6 / 140)])
def test_central_differences_droop_as_documented(order, droop):
    w = 0.3 * SLOW  # rad/s
    slope = CentralDifference(order).derivative(np.sin(w * (SHORT - SHORT[20])), SLOW)[20]
    assert 1 - slope / w == pytest.approx(droop(w / SLOW), rel=0.05)  # the next term is 0.05 of it at w/fs = 0.3


@pytest.mark.parametrize("samples", [0, 1, -2, 0.5, -0.31, 1.7])
def test_shifts_are_exact_for_sixth_degree(samples, rng):
    p = polynomial(rng, 6)
    np.testing.assert_allclose(shift(p(SHORT), samples)[INNER], p(SHORT + samples / SLOW)[INNER], atol=1e-11)


def test_cell_averages_are_exact_for_cubics(rng):
    p = polynomial(rng, 3)
    integral = p.integ()
    mean = (integral(SHORT + 0.5 / SLOW) - integral(SHORT - 0.5 / SLOW)) * SLOW
    np.testing.assert_allclose(averaged(p(SHORT), 1 / 12)[INNER], mean[INNER], atol=1e-12)
