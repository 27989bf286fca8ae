"""Torque averaged over a sampling period."""

from dataclasses import dataclass
from typing import final

import numpy as np

from identify.arrays import Array
from identify.signals.stencils import CELL, REACH, shift, slide
from identify.signals.torques.torque import AbstractTorque

_DIFFERENCE = np.array([-0.5, 0.0, 0.5])


@final
@dataclass(frozen=True, eq=False)
class AveragedTorque(AbstractTorque):
    """Sample k is the mean, from t_k + delay to t_k + delay + T with T = 1/fs, of a torque that is smooth within it.

    A torque that is itself held is `HeldTorque`, whatever measured it.
    """

    def halo(self) -> float:
        """Return the shift and the reach of the interpolations."""
        return abs(self.delay) + (REACH + 2) / self.fs

    def _mean(self) -> Array:
        """Return the mean over the window around t_k, interpolated from windows around t_k + delay + T/2."""
        return shift(self.tau, -(self.delay * self.fs + 0.5))

    def average(self, x: Array) -> Array:
        """Return the mean of `x` over a sampling period around every sample, to fourth order."""
        return slide(x, CELL)

    def _covariance(self, x: Array, tau: Array) -> Array:
        """Return (T^2/12) dx/dt d tau/dt, to fourth order."""
        return slide(tau, _DIFFERENCE) * slide(x, _DIFFERENCE) / 12
