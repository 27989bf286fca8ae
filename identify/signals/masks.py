"""Masks, and their table."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from math import ceil
from typing import Self

import numpy as np
import scipy

from idbench.identify.arrays import Array
from idbench.identify.data.jumps import velocity_noise
from idbench.identify.errors import SettingError, require_not_negative, require_positive
from idbench.identify.plugins import Table


class AbstractMask(ABC):
    """Weights of the instants: both sides of a model are multiplied by them before the operator."""

    def halo(self, fs: float) -> float:
        """How far a weight looks to either side [s]; 0 by default."""
        return 0.0

    def suited(self, qd: Array) -> "AbstractMask":
        """Return the mask with settings that follow a motion, velocities of shape (..., joint, time); itself by default."""
        return self

    @abstractmethod
    def weight(self, qd: Array, fs: float) -> Array:
        """Return weights between 0 and 1 of every joint's instants, shape (..., joint, time) like `qd` [rad/s]."""


@dataclass(frozen=True)
class NoMask(AbstractMask):
    """Keeps every instant."""

    def weight(self, qd: Array, fs: float) -> Array:
        """Return ones."""
        return np.ones_like(qd)


SLOW = 0.05  # Share of a joint's rms speed up to which it counts as turning: 0.1 rad/s of the SCARA's 2 rad/s
NOISY = 4.0  # Standard deviations of the noise of velocities up to which their sign is not known
MIN_SPEED = 1e-12  # Speed below which there is none

WIDE = (1.0, 10 / 3)
"""Width and taper of a wide mask, in tapers of a short one: 30 and 100 ms. Differences look 30 ms across a kink."""


def slow_speed(qd: Array) -> Array:
    """Speed up to which a joint rests or reverses, from velocities of shape (..., time): of its own, above noise [rad/s]."""
    own = SLOW * np.sqrt(np.mean(qd**2, axis=-1))
    return np.maximum(np.maximum(own, NOISY * velocity_noise(qd)), MIN_SPEED)


@dataclass(frozen=True)
class ReversalMask(AbstractMask):
    """Leaves out the instants at which a joint rests or reverses, where its friction is not Fs sign(qd) + Fv qd.

    The weights rise gradually: a weight that jumps would mix the noise of differentiated encoder counts, which lies at high
    frequencies, into the pass band of the operator. After a prefilter short edges serve, and keep the samples near reversals,
    which show friction best on slow robots. Of joints with strong stiction they spoil the rest: `reach`.
    """

    threshold: float | tuple[float, ...] | Array | None = None
    """A joint rests or reverses while |qd| is at most this [rad/s, of slides m/s], of all joints or of each, and where the sign
    of qd changes, shape (..., joint), optional. By default it follows each joint's own speeds and their noise: `slow_speed`."""
    width: float = 0.0
    """The instants this close [s] to such a one are left out as well."""
    taper: float = 0.03
    """Time [s] over which the weight then rises from 0 to 1, and falls."""
    reach: tuple[float, ...] = ()
    """Joints that need a wide mask (`WIDE`): multiple of the threshold up to which they are left out, shape (joint,); 0 of a
    joint with the short mask, which all have by default."""
    couplings: tuple[tuple[float, ...], ...] = ()
    """Of drives whose motor turns with several joints, what it turns for a turn of each: where it rests or reverses these
    joints are left out as well."""

    def __post_init__(self) -> None:
        for value in () if self.threshold is None else np.ravel(self.threshold):
            require_positive(threshold=float(value))
        require_not_negative(width=self.width, taper=self.taper, reach=min(self.reach, default=0.0))

    def halo(self, fs: float) -> float:
        """Return the width, the taper, and the sample next to them."""
        edges = [(self.width, self.taper), *([self._wide] if any(self.reach) else [])]
        return max((_samples(width * fs) + 2 * round(taper * fs / 2) + 1) / fs for width, taper in edges)

    def suited(self, qd: Array) -> Self:
        """Return this mask with the slow speeds of a motion, where nothing else is said."""
        return replace(self, threshold=slow_speed(qd)) if self.threshold is None else self

    def weight(self, qd: Array, fs: float) -> Array:
        """Return 1 where the joint moves, 0 where it rests or reverses, and what is between near there."""
        slow, edges = self._slow(qd), (self.width, self.taper)
        reach = np.array(self.reach)
        weight = _weight(qd, slow, edges, fs)
        if reach.any():
            weight = np.where(reach[:, None] > 0, _weight(qd, slow * np.maximum(reach, 1.0), self._wide, fs), weight)
        for coupling in self.couplings:
            turns = np.array(coupling)[:, None]
            motor = np.sum(turns * qd, axis=-2, keepdims=True)
            least = np.max(np.abs(turns[:, 0]) * slow, axis=-1, keepdims=True)
            weight = np.where(turns != 0, np.minimum(weight, _weight(motor, least, edges, fs)), weight)
        return weight

    @property
    def _wide(self) -> tuple[float, float]:
        """Width and taper of the wide mask [s]."""
        return WIDE[0] * self.taper, WIDE[1] * self.taper

    def _slow(self, qd: Array) -> Array:
        """Return the speed up to which each joint rests or reverses, shape (..., joint)."""
        threshold = np.asarray(self.suited(qd).threshold, dtype=np.float64)
        if threshold.size and threshold.shape[-1:] not in ((), (1,), (qd.shape[-2],)):
            raise SettingError(f"{len(threshold)} speeds of a mask for {qd.shape[-2]} joints: give one, or one each")
        return np.broadcast_to(threshold, qd.shape[:-1])


def _weight(qd: Array, slow: Array, edges: tuple[float, float], fs: float) -> Array:
    """Weights of the instants, with edges of some width and taper [s]."""
    slides = np.abs(qd) > slow[..., None]
    turns = np.signbit(qd[..., 1:]) != np.signbit(qd[..., :-1])  # a fast joint turns between two samples
    slides[..., 1:] &= ~turns
    slides[..., :-1] &= ~turns
    half = round(edges[1] * fs / 2)
    reach = 2 * (_samples(edges[0] * fs) + half) + 1
    wide = scipy.ndimage.minimum_filter1d(slides.astype(np.float64), reach, axis=-1, mode="nearest")
    rise = np.hanning(2 * half + 3)[1:-1]
    smooth = scipy.ndimage.convolve1d(wide, rise / rise.sum(), axis=-1, mode="nearest")
    # Sums of the weights leave some 1e-17 where all are zero, or not quite 1 where all are one.
    return np.where(smooth < 1e-12, 0.0, np.minimum(smooth, 1.0))


def _samples(width: float) -> int:
    return ceil(width - 1e-9)  # 0.03 s at 100 Hz are 3 samples, whatever the rounding of the product


MASKS: Table[AbstractMask] = Table(
    "masks",
    AbstractMask,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {"none": NoMask, "reversal": ReversalMask},
)
