"""Torque held over a sampling period."""

from dataclasses import dataclass
from typing import final

from identify.arrays import Array
from identify.signals.stencils import CELL, REACH, shift, slide
from identify.signals.torques.torque import AbstractTorque


@final
@dataclass(frozen=True, eq=False)
class HeldTorque(AbstractTorque):
    """Sample k acts, constant, from t_k + delay to t_k + delay + T, with T = 1/fs.

    What a sampled motion shows of such a staircase is its content below fs/2: the samples, T/2 + delay later, and smoothed
    by the hold, whose gain sin(w T/2) / (w T/2) is that of a mean over one period. So this torque stands at the instants
    themselves, and the columns stay as they are. (Averaging the staircase and the columns over one period instead takes
    the accelerations for smooth within it, which they are not: an error of (w T)^2 times 1/24 - (1/2 - delay/T)^2 / 2.)
    """

    def halo(self) -> float:
        """Return the delay and the reach of the interpolation."""
        return abs(self.delay) + (REACH + 2) / self.fs

    def _mean(self) -> Array:
        """Return tau, delay + T/2 later, averaged over a period."""
        return slide(shift(self.tau, -(self.delay * self.fs + 0.5)), CELL)

    def average(self, x: Array) -> Array:
        """Return `x`."""
        return x

    def _covariance(self, x: Array, tau: Array) -> float:
        """Return 0."""
        del x, tau
        return 0.0
