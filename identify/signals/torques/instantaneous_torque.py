"""Torque measured at instants."""

from dataclasses import dataclass
from typing import final

from identify.arrays import Array
from identify.signals.stencils import REACH, shift
from identify.signals.torques.torque import AbstractTorque


@final
@dataclass(frozen=True, eq=False)
class InstantaneousTorque(AbstractTorque):
    """Sample k is the torque at t_k + delay."""

    def halo(self) -> float:
        """Return the reach of the interpolation, none without a delay."""
        return abs(self.delay) + (REACH + 1) / self.fs if self.delay else 0.0

    def _mean(self) -> Array:
        """Return the torque at t_k, interpolated."""
        return shift(self.tau, -self.delay * self.fs)

    def average(self, x: Array) -> Array:
        """Return `x`: the window is an instant."""
        return x

    def _covariance(self, x: Array, tau: Array) -> float:
        """Return 0."""
        del x, tau
        return 0.0
