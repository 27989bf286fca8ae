"""Spectra and filters of finite length, as SciPy has them: without half a second in which its package is loaded."""

import numpy as np

from idbench.identify.arrays import Array


def welch(x: Array, fs: float, length: int) -> tuple[Array, Array]:
    """Return frequencies [Hz] and the one-sided power density of signals (..., time) at fs [Hz], as `scipy.signal.welch`.

    Of pieces of some length that overlap by half, without their means, through a Hann window w,

        S = 2 mean |FFT(w (x - mean))|^2 / (fs sum w^2),   at 0 and at the Nyquist frequency once.

    P. Welch, IEEE Trans. Audio and Electroacoustics 15 (1967) 70-73.
    """
    window = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(length) / length) if length > 1 else np.ones(1)
    pieces = np.lib.stride_tricks.sliding_window_view(x, length, axis=-1)[..., :: length - length // 2, :]
    centred = pieces - pieces.mean(axis=-1, keepdims=True)
    power = np.abs(np.fft.rfft(centred * window)) ** 2 / (fs * np.sum(window**2))
    power[..., 1 : -1 if length % 2 == 0 else None] *= 2
    return np.asarray(np.fft.rfftfreq(length, 1 / fs), dtype=np.float64), np.asarray(power.mean(axis=-2))


def gain_of(impulse: Array, length: int) -> Array:
    """Gain |H| = |sum of h_k exp(-2 pi i f k / fs)| of an impulse response at the frequencies of `welch`, f = i fs / length."""
    whole = np.zeros(-(-len(impulse) // length) * length)
    whole[: len(impulse)] = impulse
    return np.abs(np.fft.rfft(whole.reshape(-1, length).sum(axis=0)))  # exp(-2 pi i f k / fs) has the period `length` in k


def windowed_sinc(taps: int, cutoff: float, fs: float) -> Array:
    """Return the low-pass h = sinc(2 fc k / fs) through a Hamming window, its sum 1, as `scipy.signal.firwin`."""
    share = 2 * cutoff / fs
    h = np.sinc(share * (np.arange(taps) - (taps - 1) / 2)) * np.hamming(taps)
    return np.asarray(h / h.sum())


def parabola(window: int) -> Array:
    """Return the weights of the middle of a parabola that is fitted to so many samples, as `scipy.signal.savgol_coeffs`.

    With m samples on either side c_i = 3 (3 m^2 + 3 m - 1 - 5 i^2) / ((2 m - 1) (2 m + 1) (2 m + 3)); A. Savitzky, M. Golay,
    Analytical Chemistry 36 (1964) 1627-1639.
    """
    m = window // 2
    i = np.arange(-m, m + 1)
    return np.asarray(3 * (3 * m**2 + 3 * m - 1 - 5.0 * i**2) / ((2 * m - 1) * (2 * m + 1) * (2 * m + 3)))
