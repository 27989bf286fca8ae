"""Mask of velocity reversals and standstill."""

from dataclasses import dataclass
from math import ceil
from typing import final

import numpy as np
import scipy

from identify.arrays import Array
from identify.errors import require_not_negative, require_positive
from identify.signals.masks.mask import AbstractMask


@final
@dataclass(frozen=True)
class ReversalMask(AbstractMask):
    """Leaves out the instants at which a joint stands or turns, where its friction is not Fs sign(qd) + Fv qd.

    The weights rise gradually: a weight that jumps would mix the noise of differentiated encoder counts, which lies at high
    frequencies, into the pass band of the operator.

    Parameters
    ----------
    threshold : float
        A joint stands or turns while |qd| is at most this [rad/s], and where the sign of qd changes.
    width : float
        The instants this close [s] to such a one are left out as well: as far as differences look across the kink.
    taper : float
        Time [s] over which the weight then rises from 0 to 1, and falls.
    couplings : tuple of tuple of float
        Of drives whose motor turns with several joints, what it turns for a turn of each: where it stands or turns these joints
        are left out as well.
    """

    threshold: float = 0.1
    width: float = 0.03
    taper: float = 0.1
    couplings: tuple[tuple[float, ...], ...] = ()

    def __post_init__(self) -> None:
        require_positive(threshold=self.threshold)
        require_not_negative(width=self.width, taper=self.taper)

    def halo(self, fs: float) -> float:
        """Return the width, the taper, and the sample next to them."""
        return (self._reach(fs) + 2 * self._half(fs) + 1) / fs

    def weight(self, qd: Array, fs: float) -> Array:
        """Return 1 where the joint slides, 0 where it stands or turns, and what is between near there."""
        weight = self._weight(qd, fs)
        for coupling in self.couplings:
            motor = self._weight(np.sum(np.array(coupling)[:, None] * qd, axis=-2, keepdims=True), fs)
            weight = np.where(np.array(coupling)[:, None] != 0, np.minimum(weight, motor), weight)
        return weight

    def _weight(self, qd: Array, fs: float) -> Array:
        slides = np.abs(qd) > self.threshold
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
