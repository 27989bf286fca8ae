"""Mask of velocity reversals and standstill."""

from dataclasses import dataclass
from math import ceil
from typing import final

import numpy as np
from scipy import ndimage

from identify.arrays import Array, require_not_negative, require_positive
from identify.masks.base import AbstractMask


@final
@dataclass(frozen=True)
class ReversalMask(AbstractMask):
    """Leaves out the instants at which a joint stands or turns, where its friction is not Fs sign(qd) + Fv qd.

    Parameters
    ----------
    threshold : float
        A joint stands or turns while |qd| is at most this [rad/s], and where the sign of qd changes.
    width : float
        The instants this close [s] to such a one are left out as well: as far as differences look across the kink.
    """

    threshold: float = 0.1
    width: float = 0.03

    def __post_init__(self) -> None:
        require_positive(threshold=self.threshold)
        require_not_negative(width=self.width)

    def halo(self, fs: float) -> float:
        """Return the width, and the sample next to it."""
        return (self._reach(fs) + 1) / fs

    def weight(self, qd: Array, fs: float) -> Array:
        """Return 1 where the joint slides, 0 elsewhere."""
        slides = np.abs(qd) > self.threshold
        turns = np.signbit(qd[..., 1:]) != np.signbit(qd[..., :-1])  # a fast joint turns between two samples
        slides[..., 1:] &= ~turns
        slides[..., :-1] &= ~turns
        return ndimage.minimum_filter1d(slides.astype(np.float64), 2 * self._reach(fs) + 1, axis=-1, mode="nearest")

    def _reach(self, fs: float) -> int:
        return ceil(self.width * fs - 1e-9)  # 0.03 s at 100 Hz are 3 samples, whatever the rounding of the product
