"""Logged velocities: compared with differences of the positions, and used where they are less noisy."""

from collections.abc import Iterable
from dataclasses import dataclass
from math import comb

import numpy as np
import numpy.typing as npt
import scipy

from idbench.identify.arrays import Array

BAND = 5.0
"""Frequency [Hz] up to which velocities are compared with differences."""

ALIKE = 0.03
"""Departure of velocities from differences, as a share, up to which they are in the same unit."""

LATE = 0.5
"""Delay of velocities, in sampling periods, up to which they are of the same instants."""

ORDER = 6
"""Differences of a signal after which next to nothing of a motion is left, and of white noise much."""

HIGHEST = 10.0
"""Frequency [Hz] above which less noisy velocities do not matter: little of a motion is there."""


@dataclass(frozen=True, eq=False)
class Velocities:
    """What logged velocities are worth, joint by joint."""

    scale: Array
    """Logged velocity over differences of the positions, below 5 Hz, shape (joint,)."""
    delay: Array
    """Of the logged velocity [s], shape (joint,)."""
    crossover: Array
    """Frequency [Hz] above which the integral of the velocity is less noisy than the positions are, shape (joint,)."""
    fs: float
    """Sampling frequency [Hz]."""

    @classmethod
    def of(cls, q: Array, qd: Array, fs: float) -> "Velocities":
        """Return what the logged velocities `qd` of the positions `q` are worth, shape (time, joint) each.

        White noise of the positions, of standard deviation sigma_q, and of the velocities, sigma_v, is compared: integrated,
        the latter is sigma_v / (2 pi f), less than sigma_q above f = sigma_v / (2 pi sigma_q).
        """
        slow = scipy.signal.butter(2, min(BAND, fs / 5), fs=fs, output="sos")
        filtered = [scipy.signal.sosfiltfilt(slow, x, axis=0) for x in (np.gradient(q, 1 / fs, axis=0), qd)]
        v, logged = (x[len(x) // 20 : -len(x) // 20] for x in filtered)
        dv = np.gradient(v, 1 / fs, axis=0)
        scale, delay = np.ones(q.shape[1]), np.zeros(q.shape[1])
        for j in range(q.shape[1]):
            if np.any(v[:, j]):
                a, b = np.linalg.lstsq(np.stack([v[:, j], -dv[:, j]], axis=1), logged[:, j])[0]
                scale[j], delay[j] = a, b / a if a else np.nan
        return cls(scale, delay, white_noise(qd) / np.maximum(2 * np.pi * white_noise(q), 1e-300), fs)

    @property
    def consistent(self) -> npt.NDArray[np.bool_]:
        """Whether each joint's velocities are those of its positions, in unit and time."""
        same = np.abs(self.scale - 1) <= ALIKE
        return np.logical_and(same, np.abs(self.delay) <= LATE / self.fs)

    @property
    def used(self) -> npt.NDArray[np.bool_]:
        """Whether the velocities of each joint are less noisy than differences."""
        return np.logical_and(self.consistent, self.crossover < min(HIGHEST, self.fs / 10))

    def words(self, joints: tuple[str, ...]) -> list[str]:
        """Return what was found, a sentence each."""
        found = []
        if self.used.any():
            each = [
                f"{joint} (above {f:.2g} Hz)" for joint, f, use in zip(joints, self.crossover, self.used, strict=True) if use
            ]
            found.append(f"logged velocities are less noisy than differences of the positions, and are used: {', '.join(each)}")
        elif self.consistent.all():
            found.append("logged velocities agree with differences of the positions, which are as accurate and are used")
        known = list(zip(joints, self.scale, self.delay, self.consistent, strict=True))
        scaled = {joint: a for joint, a, _, same in known if not same and abs(a - 1) > ALIKE}
        late = {joint: 1e3 * d for joint, _, d, same in known if not same and joint not in scaled}
        if scaled:
            what = f"{_between(scaled.values())} times the differences of the positions: not used; units?"
            found.append(f"logged velocities of {', '.join(scaled)} are {what}")
        if late:
            found.append(f"logged velocities of {', '.join(late)} are {_between(late.values())} ms late: not used")
        return found

    def improved(self, q: Array, qd: Array) -> Array:
        """Return positions that follow the integral of the velocities above the crossover, and themselves below it."""
        found = np.array(q)
        for j in np.flatnonzero(self.used):
            way = np.concatenate([[0.0], np.cumsum((qd[1:, j] + qd[:-1, j]) / 2)]) / self.fs
            slow = scipy.signal.butter(2, max(self.crossover[j], 4 * self.fs / len(q)), fs=self.fs, output="sos")
            found[:, j] = way + scipy.signal.sosfiltfilt(slow, q[:, j] - way, padlen=min(len(q) - 1, round(self.fs)))
        return found


def _between(values: Iterable[float]) -> str:
    """Return a number, or two between which all are."""
    low, high = f"{min(values := list(values)):.3g}", f"{max(values):.3g}"
    return low if low == high else f"{low} to {high}"


def white_noise(x: Array) -> Array:
    """Return the standard deviation of white noise, from differences of higher order, shape (joint,)."""
    differences = np.diff(x, ORDER, axis=0)
    return np.asarray(np.sqrt(np.median(differences**2, axis=0) / 0.4549 / comb(2 * ORDER, ORDER)))
