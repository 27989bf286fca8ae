"""Torque held over a sampling period."""

from dataclasses import dataclass
from typing import final

import numpy as np

from identify.arrays import Array
from identify.stencils import CELL, REACH, shift, slide
from identify.torques.base import AbstractTorque


@final
@dataclass(frozen=True, eq=False)
class HeldTorque(AbstractTorque):
    """Sample k acts, constant, from t_k + delay to t_k + delay + T, with T = 1/fs.

    Over the window [t_k - T/2, t_k + T/2] two samples act, the older one until t_k + x T, where x in [-1/2, 1/2] is what
    is left of delay / T after whole periods.
    """

    def halo(self) -> float:
        """Return the delay and the reach of the interpolation of q between samples."""
        return abs(self.delay) + (REACH + 1) / self.fs

    def mean(self) -> Array:
        """Return (1/2 - x) tau_(k-m) + (1/2 + x) tau_(k-m-1), exactly the mean over the window."""
        older, newer, x = self._acting()
        return (0.5 - x) * newer + (0.5 + x) * older

    def power(self, q: Array, qd: Array) -> Array:
        """Return the work of the two samples over the window, divided by T: a held torque times the angle turned."""
        del qd
        older, newer, x = self._acting()
        start, change, end = shift(q, -0.5), shift(q, x), shift(q, 0.5)
        work = older * (change - start) + newer * (end - change)
        return np.sum(work, axis=-2, keepdims=True) * self.fs

    def average(self, x: Array) -> Array:
        """Return the mean of `x` over a sampling period around every sample, to fourth order."""
        return slide(x, CELL)

    def _acting(self) -> tuple[Array, Array, float]:
        whole = round(self.delay * self.fs)
        older, newer = shift(self.tau, -whole - 1), shift(self.tau, -whole)
        return older, newer, self.delay * self.fs - whole
