"""Masks, and their table."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from math import ceil
from typing import Self, final

import numpy as np
import scipy

from idbench.identify.arrays import Array
from idbench.identify.errors import SettingError, require_not_negative, require_positive
from idbench.identify.plugins import Table


class AbstractMask(ABC):
    """Weights of the instants: both sides of a model are multiplied by them before the operator."""

    @abstractmethod
    def halo(self, fs: float) -> float:
        """Return how far [s] a weight looks to either side."""

    def suited(self, qd: Array) -> "AbstractMask":
        """Return the mask with settings that follow a motion, velocities of shape (..., joint, time); itself by default."""
        del qd
        return self

    @abstractmethod
    def weight(self, qd: Array, fs: float) -> Array:
        """Return weights between 0 and 1 of every joint's instants, shape (..., joint, time) like `qd` [rad/s]."""


@final
@dataclass(frozen=True)
class NoMask(AbstractMask):
    """Keeps every instant."""

    def halo(self, fs: float) -> float:
        """Return 0."""
        del fs
        return 0.0

    def weight(self, qd: Array, fs: float) -> Array:
        """Return ones."""
        del fs
        return np.ones_like(qd)


SLOW = 0.05
"""Share of a joint's rms speed up to which it counts as turning: 0.1 rad/s of the SCARA's 2 rad/s."""

MIN_SPEED = 1e-12
"""Speed below which there is none."""

NOISY = 4.0
"""Standard deviations of the noise of velocities up to which their sign is not known."""

THIRD = 3
"""Order of the differences of velocities in which motion vanishes beside noise."""

QUIET = 0.8
"""Quantile of the absolute third differences of velocities that measures their noise: most of any motion is smooth."""


def slow_speed(qd: Array) -> Array:
    """Return the speed up to which a joint rests or reverses, from velocities of shape (..., time): of its own, above noise."""
    rms = np.sqrt(np.mean(qd**2, axis=-1))
    if qd.shape[-1] <= THIRD:
        return np.maximum(SLOW * rms, MIN_SPEED)
    kinks = np.abs(np.diff(qd, THIRD, axis=-1))
    size = scipy.special.ndtri((1 + QUIET) / 2) * np.sqrt(scipy.special.comb(2 * THIRD, THIRD))
    noise = np.quantile(kinks, QUIET, axis=-1) / size
    return np.maximum(np.minimum(np.maximum(SLOW * rms, NOISY * noise), most_masked(qd)), MIN_SPEED)


def most_masked(qd: Array) -> Array:
    """Return the speed that half of a joint's moving time is below, of velocities (..., time): no mask takes more."""
    speed = np.abs(qd)
    moving = speed > np.maximum(SLOW * np.sqrt(np.mean(qd**2, axis=-1, keepdims=True)), MIN_SPEED)
    ordered = np.sort(np.where(moving, speed, -1.0), axis=-1)
    count = np.count_nonzero(moving, axis=-1)
    place = np.clip(qd.shape[-1] - 1 - count // 2, 0, qd.shape[-1] - 1)
    return np.asarray(np.take_along_axis(ordered, place[..., None], axis=-1)[..., 0])


@final
@dataclass(frozen=True)
class ReversalMask(AbstractMask):
    """Leaves out the instants at which a joint rests or reverses, where its friction is not Fs sign(qd) + Fv qd.

    The weights rise gradually: a weight that jumps would mix the noise of differentiated encoder counts, which lies at high
    frequencies, into the pass band of the operator.
    """

    threshold: float | tuple[float, ...] | Array | None = None
    """A joint rests or reverses while |qd| is at most this [rad/s, of slides m/s], of all joints or of each, and where the sign
    of qd changes, shape (..., joint), optional. By default it follows each joint's own speeds and their noise: `slow_speed`."""
    width: float = 0.03
    """The instants this close [s] to such a one are left out as well: as far as differences look across the kink."""
    taper: float = 0.1
    """Time [s] over which the weight then rises from 0 to 1, and falls."""
    couplings: tuple[tuple[float, ...], ...] = ()
    """Of drives whose motor turns with several joints, what it turns for a turn of each: where it rests or reverses these
    joints are left out as well."""

    def __post_init__(self) -> None:
        for value in () if self.threshold is None else np.ravel(self.threshold):
            require_positive(threshold=float(value))
        require_not_negative(width=self.width, taper=self.taper)

    def halo(self, fs: float) -> float:
        """Return the width, the taper, and the sample next to them."""
        return (self._reach(fs) + 2 * self._half(fs) + 1) / fs

    def suited(self, qd: Array) -> Self:
        """Return this mask with the slow speeds of a motion, where nothing else is said."""
        return replace(self, threshold=slow_speed(qd)) if self.threshold is None else self

    def weight(self, qd: Array, fs: float) -> Array:
        """Return 1 where the joint moves, 0 where it rests or reverses, and what is between near there."""
        slow = self._slow(qd)
        weight = self._weight(qd, slow, fs)
        for coupling in self.couplings:
            turns = np.array(coupling)[:, None]
            motor = np.sum(turns * qd, axis=-2, keepdims=True)
            least = np.max(np.abs(turns[:, 0]) * slow, axis=-1, keepdims=True)
            weight = np.where(turns != 0, np.minimum(weight, self._weight(motor, least, fs)), weight)
        return weight

    def _slow(self, qd: Array) -> Array:
        """Return the speed up to which each joint rests or reverses, shape (..., joint)."""
        threshold = np.asarray(self.suited(qd).threshold, dtype=np.float64)
        if threshold.size and threshold.shape[-1:] not in ((), (1,), (qd.shape[-2],)):
            raise SettingError(f"{len(threshold)} speeds of a mask for {qd.shape[-2]} joints: give one, or one each")
        return np.broadcast_to(threshold, qd.shape[:-1])

    def _weight(self, qd: Array, slow: Array, fs: float) -> Array:
        slides = np.abs(qd) > slow[..., None]
        turns = np.signbit(qd[..., 1:]) != np.signbit(qd[..., :-1])  # a fast joint turns between two samples
        slides[..., 1:] &= ~turns
        slides[..., :-1] &= ~turns
        half = self._half(fs)
        wide = _eroded(slides.astype(np.float64), self._reach(fs) + half)
        rise = np.hanning(2 * half + 3)[1:-1]
        smooth = scipy.ndimage.convolve1d(wide, rise / rise.sum(), axis=-1, mode="nearest")
        # Sums of the weights leave some 1e-17 where all are zero, or not quite 1 where all are one.
        return np.where(smooth < 1e-12, 0.0, np.minimum(smooth, 1.0))

    def _reach(self, fs: float) -> int:
        return ceil(self.width * fs - 1e-9)  # 0.03 s at 100 Hz are 3 samples, whatever the rounding of the product

    def _half(self, fs: float) -> int:
        return round(self.taper * fs / 2)


def _eroded(weight: Array, reach: int) -> Array:
    return scipy.ndimage.minimum_filter1d(weight, 2 * reach + 1, axis=-1, mode="nearest")


MASKS: Table[AbstractMask] = Table(
    "masks",
    AbstractMask,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {
        "none": NoMask,
        "reversal": ReversalMask,
    },
)
