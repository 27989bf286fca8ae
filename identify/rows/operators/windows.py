"""Integrals over consecutive windows."""

from dataclasses import dataclass
from typing import final

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.errors import SettingError, require_positive
from idbench.identify.rows.operators.weak_form import AbstractWeakForm, Kernels


@final
@dataclass(frozen=True)
class Windows(AbstractWeakForm):
    """Integrals over consecutive windows [ta, tb]: power becomes the energy model (Eq. 11, 20), implicit its integral form."""

    length: float = 0.1
    """Tb - ta [s]; the paper's n_d / fs."""

    def __post_init__(self) -> None:
        require_positive(length=self.length)

    def step(self, fs: float) -> int:
        """Return the samples of a window, at least 2."""
        samples = round(self.length * fs)
        if samples < 2:
            raise SettingError(
                f"windows of {self.length:g} s hold {samples} samples at fs = {fs:g} Hz, fewer than 2: use longer"
            )
        return samples

    def kernels(self, fs: float) -> Kernels:
        """Return Simpson's rule, and the difference of the window's ends."""
        intervals = self.step(fs)
        ends = np.zeros(intervals + 1)
        ends[0], ends[-1] = -1.0, 1.0
        return Kernels(_simpson(intervals) / fs, ends)


def _simpson(intervals: int) -> Array:
    """Return the weights of Simpson's rule over unit intervals; an odd number of them ends with the 3/8 rule."""
    weights = np.zeros(intervals + 1)
    paired = intervals - 3 * (intervals % 2)
    weights[0:paired:2] += 1 / 3
    weights[1:paired:2] += 4 / 3
    weights[2 : paired + 1 : 2] += 1 / 3
    if intervals % 2:
        weights[-4:] += np.array([3, 9, 9, 3]) / 8
    return weights
