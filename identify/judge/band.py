"""The band of a fit: how much of what moves it should see."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy

from idbench.identify.arrays import Array
from idbench.identify.data.motion_log import MotionLog
from idbench.identify.estimators.problem import Problem
from idbench.identify.rows.rows import Rows
from idbench.identify.signals.masks import slow_speed
from idbench.identify.signals.spectra import welch

BANDS = np.array([1.0, 2.0, 3.0, 4.0])
"""Ends of the bands of speeds that are looked at, in multiples of what the mask takes: a fifth of the rms speed at most."""

EXCESS = 1.5
"""Rms of the residual in a band, relative to faster motion, above which the band does more harm than good."""

INDEPENDENT = 0.5
"""Share of the rows that count as independent, as neighbours share noise: with all, ten times too many masks are raised."""

CERTAIN = 1e-3
"""Probability that noise alone makes as much, below which it is believed."""


def slow_motion(problem: Problem, X: Array) -> tuple[Array, Array]:
    """Return up to which speed each joint's mask takes motion, and what it should be multiplied by.

    What the explicit model leaves of a joint's torque in slow motion is compared with what it leaves of fast motion (F test). A
    real joint's friction does not jump where its velocity changes sign; one that slides within hundredths of a turn, or has
    grease to squeeze, follows another law there.

    Parameters
    ----------
    problem : Problem
        The explicit model with a `ReversalMask` whose threshold follows the motion.
    X : Array, shape (p,)
        Its estimate.

    Returns
    -------
    speed : Array, shape (joint,)
        Up to which joints rest or reverse [rad/s, m/s], on average over the logs.
    factor : Array, shape (joint,)
        1 where friction is the same down to that speed; else the end of the fastest band where it is not.
    """
    every = [_seen(part.rows, X) for part in problem.parts]
    speed = np.mean([slow for slow, _, _ in every], axis=0)
    factor = np.ones(len(speed))
    for j in range(len(speed)):
        multiple = np.concatenate([v[j] for _, v, _ in every])
        left = np.concatenate([r[j] for _, _, r in every])
        fast = left[multiple > BANDS[-1]]
        for low, high in pairwise(BANDS):
            if _wrong(left[(multiple > low) & (multiple <= high)], fast):
                factor[j] = high
    return speed, factor


def _seen(part: Rows, X: Array) -> tuple[Array, Array, Array]:
    """Return the speeds of the mask, and of every row the joint's speed in multiples of it and the residual; NaN if masked."""
    signals = part.maps[0].signals
    qd = signals.state.qd
    slow = slow_speed(qd)
    left, valid = part.by_kind(part.Y - part.predicted(X)), part.by_kind(part.valid)
    at = np.clip(np.round(part.by_kind(part.time) * signals.fs).astype(np.intp), 0, qd.shape[-1] - 1)
    return slow, np.where(valid, np.abs(np.take_along_axis(qd, at, axis=-1)) / slow[:, None], np.nan), left


def _wrong(some: Array, fast: Array) -> bool:
    """Return whether the residual of some rows is significantly larger than in fast motion."""
    if len(some) < 2 or len(fast) < 2 * len(BANDS) or not fast.any():
        return False
    ratio = float(np.mean(some**2) / np.mean(fast**2))
    return ratio > EXCESS**2 and float(scipy.special.fdtrc(INDEPENDENT * len(some), INDEPENDENT * len(fast), ratio)) < CERTAIN


ENOUGH = 4
"""Instants for each parameter below which a fit starves."""

ABOVE = 4.0
"""Power over that of the noise up to which a frequency still counts as content."""

OF_NYQUIST = 0.4
"""Share of the Nyquist frequency above which no band goes: filters and differences need room."""

SEGMENT = 2.0
"""Length of the pieces whose spectra are averaged [s]."""

FLOOR = (0.6, 0.95)
"""Part of the spectrum, as shares of the Nyquist frequency, that is taken for noise."""


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
        """Return what was chosen, and why; nothing where the default serves."""
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
    """Return where a spectrum first falls to its floor, smoothed over three lines."""
    smooth = np.convolve(np.pad(power, 1, mode="edge"), np.ones(3) / 3, mode="valid")
    faint = np.flatnonzero(smooth[1:] <= ABOVE * floor)
    return float(f[1 + faint[0]]) if len(faint) else float(f[-1])
