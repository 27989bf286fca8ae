"""The implicit dynamic model."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

import numpy as np

from identify.arrays import Array, Columns
from identify.basis import Basis
from identify.models.base import AbstractModel
from identify.signals import Signals


@final
@dataclass(frozen=True)
class ImplicitModel(AbstractModel):
    """Implicit dynamic model, tau = [R(q, qd) + s M_i(q) qd] X (Eq. 7-9)."""

    def y(self, signals: Signals) -> Array:
        """Return tau."""
        return signals.torque.mean()

    def c(self, basis: Basis, signals: Signals) -> Columns:
        """Return R(q, qd)."""
        return basis.remainder(signals.state)

    def e(self, basis: Basis, signals: Signals) -> Columns:
        """Return M_i(q) qd."""
        return basis.momentum(signals.state)

    def B(self, signals: Signals) -> Mapping[tuple[int, int], Array]:
        """Return ones: a row a joint."""
        return {(j, j): np.ones(1) for j in range(signals.state.n)}

    def weight(self, signals: Signals) -> Array:
        """Return the weight of each joint for its own row."""
        return signals.weight

    def noise(self, signals: Signals) -> Array:
        """Return ones: torque noise reaches all rows of a joint alike."""
        return np.ones_like(signals.weight)
