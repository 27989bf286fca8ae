"""Torque measured at instants."""

from dataclasses import dataclass
from typing import final

import numpy as np

from identify.arrays import Array
from identify.stencils import REACH, shift
from identify.torques.base import AbstractTorque


@final
@dataclass(frozen=True, eq=False)
class InstantaneousTorque(AbstractTorque):
    """Sample k is the torque at t_k + delay."""

    def halo(self) -> float:
        """Return the reach of the interpolation, none without a delay."""
        return abs(self.delay) + (REACH + 1) / self.fs if self.delay else 0.0

    def mean(self) -> Array:
        """Return the torque at t_k, interpolated."""
        return shift(self.tau, -self.delay * self.fs)

    def power(self, q: Array, qd: Array) -> Array:
        """Return qd' tau at t_k."""
        del q
        return np.sum(qd * self.mean(), axis=-2, keepdims=True)

    def average(self, x: Array) -> Array:
        """Return `x`: the window is an instant."""
        return x
