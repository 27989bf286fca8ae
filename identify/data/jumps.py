"""Jumps of logged positions: wild samples, and encoders that slip."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import comb

import numpy as np
import numpy.typing as npt
import scipy

from idbench.identify.arrays import TINY, Array

OFF = 0.05  # Share of a step by which a difference of positions may miss a whole number of steps: files are rounded
MIN_DIFFERENCES = 20  # Differences that it takes
MAX_STEPS = 1000  # Steps of a difference up to which rounding of the step itself does not matter


def encoder_steps(q: Array) -> Array:
    """Step of every joint's encoder [rad], shape (joint,), by logged positions q [rad], shape (..., time, joint).

    NaN where positions are no multiples of one.
    """
    moved = np.abs(np.diff(q, axis=-2)).reshape(-1, q.shape[-1])
    return np.array([_step(moved[:, j]) for j in range(q.shape[-1])])


def _step(moved: Array) -> float:
    """Return the largest number of which all differences are whole multiples."""
    rounding = 1e-9 * max(float(moved.max(initial=0.0)), 1e-9)
    found = np.sort(moved[moved > rounding])
    if len(found) < MIN_DIFFERENCES:
        return np.nan
    step = float(found[0])
    for divisor in (1, 2, 3, 4, 5):
        refined = _refined(found, step / divisor)
        if np.isfinite(refined):
            return refined
    return np.nan


def _refined(found: Array, step: float) -> float:
    """Return the step that fits differences, the smallest first, from a first guess; NaN if few are its multiples."""
    for most in (5, 50, MAX_STEPS):
        some = found[found < (most + 0.5) * step]
        if most == MAX_STEPS and len(some) < MIN_DIFFERENCES:
            return np.nan
        count = np.round(some / step)
        if (np.abs(some / step - count) > OFF).any():
            return np.nan
        step = float(count @ some / (count @ count))
    return step


COMMON = 0.99
"""Share of the steps from one sample to the next that are below what is usual: those above may be the fastest of a motion."""

NEAR = 2  # Steps to either side that a step is compared with
SPREAD = 3.0  # A step jumps if it is farther from the median of its neighbours than this many times their scatter
RETURN = 0.2  # Share of a jump that may be left after it has gone back
ROUNDING = 1e-3  # Share of the largest travel of a joint that no jump is below
COUNTS = 2.5  # Steps of its encoder that no jump is below: quiet joints tremble by one, and creep by one after the other


@dataclass(frozen=True)
class Jump:
    """A step of a position that the motion around it does not explain."""

    joint: int
    """Number of the joint, from 0."""
    sample: int
    """Number of the sample, from 0."""
    size: float
    """By how far [rad, m]."""
    speed: float
    """Its speed [rad/s, m/s]."""
    usual: float
    """Speed below which nearly all steps of the joint are [rad/s, m/s]."""
    back: bool
    """Whether the position comes back at once: a wild sample, not a slip."""


def jumps(q: Array, fs: float) -> list[Jump]:
    """Jumps of positions q [rad, m], shape (time, joint), sampled at fs [Hz], joint by joint.

    A step counts that is larger than 99 % of the joint's steps, and farther from the median of its neighbours than these
    scatter: a fast motion has fast neighbours.

    Examples
    --------
    >>> q = np.sin(np.arange(500)[:, None] / 50)
    >>> q[200:] += 0.5
    >>> [(jump.joint, jump.sample, jump.back) for jump in jumps(q, 100.0)]
    [(0, 200, False)]
    """
    steps = encoder_steps(q)
    known = steps[np.isfinite(steps)]
    usual = float(np.median(known)) if len(known) else 0.0  # of joints that hardly move: like the encoders of the others
    tremble = COUNTS * np.where(np.isfinite(steps), steps, usual)
    least = np.maximum(tremble, ROUNDING * np.ptp(q, axis=0).max(initial=0.0))
    return [jump for j, x in enumerate(q.T) for jump in _of_joint(j, np.asarray(x), float(least[j]), fs)]


def dropouts(found: Sequence[Jump]) -> int:
    """Number of instants at which positions jump for good; joints that jump together count once, and neighbours do."""
    at = sorted({jump.sample for jump in found if not jump.back})
    return sum(k == 0 or at[k] - at[k - 1] > NEAR for k in range(len(at)))


def _of_joint(j: int, x: Array, least: float, fs: float) -> list[Jump]:
    steps, found = np.diff(x), list[Jump]()
    if len(steps) <= 2 * NEAR:
        return found
    usual = float(np.quantile(np.abs(steps), COMMON))
    padded = np.pad(steps, NEAR, mode="edge")
    around = np.stack([padded[i : i + len(steps)] for i in range(2 * NEAR + 1) if i != NEAR])
    middle = np.median(around, axis=0)
    off, scatter = np.abs(steps - middle), np.median(np.abs(around - middle), axis=0)
    least = max(usual, least)
    left = np.flatnonzero((off > least) & (off > SPREAD * scatter))
    while len(left):
        k, near = left[0], left[left - left[0] <= NEAR]
        size, total = float(steps[k] - middle[k]), float(np.sum(steps[near] - middle[near]))
        back = len(near) > 1 and abs(total) < RETURN * abs(size)
        found.append(Jump(j, int(k) + 1, size, abs(float(steps[k])) * fs, usual * fs, back))
        left = left[left > near[-1]]
    return found


BAND = 5.0  # Frequency [Hz] up to which velocities are compared with differences
ALIKE = 0.03  # Departure of velocities from differences, as a share, up to which they are in the same unit
LATE = 0.5  # Delay of velocities, in sampling periods, up to which they are of the same instants
ORDER = 6  # Differences of a signal after which next to nothing of a motion is left, and of white noise much
HIGHEST = 10.0  # Frequency [Hz] above which less noisy velocities do not matter: little of a motion is there


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
        """Quality of the logged velocities `qd` of the positions `q`, shape (time, joint) each.

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
        return cls(scale, delay, white_noise(qd) / np.maximum(2 * np.pi * white_noise(q), TINY), fs)

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
        """Findings, one sentence each."""
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


THIRD = 3  # Order of the differences of velocities in which motion vanishes beside noise
QUIET = 0.8  # Quantile of the absolute third differences of velocities that measures their noise: most of any motion is smooth


def velocity_noise(qd: Array) -> Array:
    """Standard deviation of white noise in velocities of shape (..., time), from their third differences; 0 of too few."""
    if qd.shape[-1] <= THIRD:
        return np.zeros(qd.shape[:-1])
    kinks = np.abs(np.diff(qd, THIRD, axis=-1))
    size = scipy.special.ndtri((1 + QUIET) / 2) * np.sqrt(scipy.special.comb(2 * THIRD, THIRD))
    return np.asarray(np.quantile(kinks, QUIET, axis=-1) / size)
