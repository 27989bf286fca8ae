"""Spectra and filters of our own against SciPy's."""

import numpy as np
import pytest
import scipy

from idbench.identify.signals.spectra import gain_of, parabola, welch, windowed_sinc

EXACT = 1e-13
"""Sums of some thousand doubles, each rounded to 1e-16."""


@pytest.mark.parametrize(("samples", "length"), [(1000, 1000), (1000, 256), (1001, 255), (97, 10), (5000, 2), (7, 1)])
def test_welch(samples, length, rng):
    x = 3.0 + rng.normal(size=(2, samples))
    f, power = welch(x, 250.0, length)
    expected = scipy.signal.welch(x, 250.0, nperseg=length, detrend="constant", axis=-1)
    np.testing.assert_allclose(f, expected[0], rtol=EXACT)
    np.testing.assert_allclose(power, expected[1], rtol=1e-9, atol=EXACT * expected[1].max())


@pytest.mark.parametrize("taps", [3, 11, 100, 1001])
def test_low_pass_and_its_gain(taps):
    h = windowed_sinc(taps, 5.0, 250.0)
    np.testing.assert_allclose(h, scipy.signal.firwin(taps, 5.0, window="hamming", fs=250.0), atol=EXACT)
    for length in (1, 7, 100, 598):
        f = np.fft.rfftfreq(length, 1 / 250.0)
        np.testing.assert_allclose(gain_of(h, length), np.abs(scipy.signal.freqz(h, worN=f, fs=250.0)[1]), atol=1e-11)


@pytest.mark.parametrize("window", [3, 5, 21, 101])
def test_parabola(window):
    np.testing.assert_allclose(parabola(window), scipy.signal.savgol_coeffs(window, 2), atol=EXACT)
