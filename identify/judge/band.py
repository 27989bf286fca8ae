"""The band of a fit: how much of what moves it should see."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.data.motion_log import MotionLog
from idbench.identify.judge.used_rows import OF_NYQUIST
from idbench.identify.signals.spectra import welch

ENOUGH = 4  # Instants for each parameter below which a fit starves
ABOVE = 4.0  # Power over that of the noise up to which a frequency still counts as content
SEGMENT = 2.0  # Length of the pieces whose spectra are averaged [s]
FLOOR = (0.6, 0.95)  # Part of the spectrum, as shares of the Nyquist frequency, that is taken for noise


@dataclass(frozen=True)
class Band:
    """A cut-off frequency, and why."""

    cutoff: float
    """[Hz]."""
    rows: float
    """Instants that it makes of the logs."""
    wanted: float
    """Cut-off [Hz] at which there are enough rows for every parameter."""
    content: float
    """Frequency [Hz] from which on the torques are noise."""

    @classmethod
    def of(cls, logs: Sequence[MotionLog], parameters: int, least: float) -> "Band":
        """Return the band for logs of so many parameters: `least` [Hz], or more where that leaves too few rows.

        It is less where logs are slow. Rows come at twice the cut-off: T seconds make 2 T f instants, and a power model has one
        row per instant. A short, fast log starves at 5 Hz. Above twice the frequency at which the torques are noise there is
        nothing: power is a product.
        """
        T = sum(log.samples / log.fs for log in logs)
        content = max(content_end(log) for log in logs)
        wanted = ENOUGH * parameters / (2 * T)
        most = min(OF_NYQUIST * log.fs / 2 for log in logs)
        cutoff = max(min(max(wanted, least), max(2 * content, least)), least)
        cutoff = float(f"{min(cutoff, most):.2g}")
        return cls(cutoff, 2 * T * cutoff, wanted, content)

    def words(self, parameters: int, least: float) -> str:
        """The chosen band and its reason; nothing where the default serves."""
        if self.cutoff < least:
            return (
                f"band up to {self.cutoff:.2g} Hz instead of {least:g}, since the log is sampled slowly (--cutoff says another)"
            )
        if self.cutoff == least:
            return ""
        few = self.rows * least / self.cutoff
        enough = f"{self.rows:.0f} instants for {parameters} parameters, where {least:g} Hz leave {few:.0f}"
        noise = "" if self.cutoff >= 0.99 * self.wanted else f"; above {self.content:.2g} Hz the torques are noise"
        return f"band up to {self.cutoff:.2g} Hz, chosen by the log: {enough}{noise} (--cutoff says another)"


def content_end(log: MotionLog) -> float:
    """Return the frequency [Hz] above which no torque of a log stands out of its noise."""
    tau = log.tau.reshape(-1, log.samples, log.n)[0]
    f, power = welch(tau.T, log.fs, min(log.samples, round(SEGMENT * log.fs)))
    low, high = (share * log.fs / 2 for share in FLOOR)
    floor = np.median(power[:, (f > low) & (f < high)], axis=1)
    return max(_end(f, p, x) for p, x in zip(power, floor, strict=True))


def _end(f: Array, power: Array, floor: float) -> float:
    """First frequency at which a spectrum, smoothed over three lines, is at its floor."""
    smooth = np.convolve(np.pad(power, 1, mode="edge"), np.ones(3) / 3, mode="valid")
    faint = np.flatnonzero(smooth[1:] <= ABOVE * floor)
    return float(f[1 + faint[0]]) if len(faint) else float(f[-1])
