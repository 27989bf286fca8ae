"""The power model, which windows turn into the energy model."""

from dataclasses import dataclass
from typing import final

import numpy as np

from identify.arrays import Array, Columns
from identify.basis import Basis
from identify.models.base import AbstractModel
from identify.signals import Signals


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

    def weight(self, signals: Signals) -> Array:
        """Return the product of the joints' weights: one row holds the power of all of them."""
        return np.prod(signals.weight, axis=-2, keepdims=True)
