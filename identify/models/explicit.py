"""The explicit dynamic model."""

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
class ExplicitModel(AbstractModel):
    """Explicit dynamic model, tau = D(q, qd, qdd) X (Eq. 5, 6)."""

    def y(self, signals: Signals) -> Array:
        """Return tau."""
        return signals.torque.mean()

    def c(self, basis: Basis, signals: Signals) -> Columns:
        """Return D(q, qd, qdd)."""
        return basis.explicit(signals.state)

    def e(self, basis: Basis, signals: Signals) -> Columns:
        """Return no columns."""
        del basis, signals
        return {}

    def B(self, signals: Signals) -> Mapping[tuple[int, int], Array]:
        """Return ones: a row a joint."""
        return {(j, j): np.ones(1) for j in range(signals.state.n)}

    def weight(self, signals: Signals) -> Array:
        """Return the weight of each joint for its own row."""
        return signals.weight

    def noise(self, signals: Signals) -> Array:
        """Return ones: torque noise reaches all rows of a joint alike."""
        return np.ones_like(signals.weight)
