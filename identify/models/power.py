"""The power model, which windows turn into the energy model."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

import numpy as np

from identify.arrays import Array, Columns
from identify.basis import Basis
from identify.models.base import AbstractModel
from identify.signals import Signals

SLOW = 1.5
"""Speed [rad/s] below which the noise of a power row does not fall any more: that of the measured velocity remains.

Chosen by simulations with 16-bit encoders and with torque noise; errors are within 20 % of the best between 0.6 and 2.5."""


@final
@dataclass(frozen=True)
class PowerModel(AbstractModel):
    """Power model, qd' tau = [qd' Gamma_f + s h(q, qd)] X (Eq. 10, 23); over windows, the energy model (Eq. 11, 20)."""

    def y(self, signals: Signals) -> Array:
        """Return qd' tau."""
        return signals.torque.power(signals.state.q, signals.state.qd)

    def c(self, basis: Basis, signals: Signals) -> Columns:
        """Return the dissipated power."""
        return basis.dissipation(signals.state)

    def e(self, basis: Basis, signals: Signals) -> Columns:
        """Return the energies h(q, qd)."""
        return basis.energy(signals.state)

    def B(self, signals: Signals) -> Mapping[tuple[int, int], Array]:
        """Return qd'."""
        return {(0, j): signals.state.qd[..., j, :] for j in range(signals.state.n)}

    def weight(self, signals: Signals) -> Array:
        """Return ones: the power of a friction, Fs |qd|, is continuous where a joint turns, and needs no mask."""
        return np.ones_like(signals.weight[..., :1, :])

    def noise(self, signals: Signals) -> Array:
        """Return sqrt(|qd|^2 + SLOW^2): torque noise reaches a row multiplied by the velocities."""
        return np.sqrt(np.sum(signals.state.qd**2, axis=-2, keepdims=True) + SLOW**2)
