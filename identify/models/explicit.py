"""The explicit dynamic model."""

from dataclasses import dataclass
from typing import final

from idbench.identify.arrays import Columns, Multipliers
from idbench.identify.basis.basis import Basis
from idbench.identify.models.model import AbstractModel, each_joint
from idbench.identify.signals.state import State


@final
@dataclass(frozen=True)
class ExplicitModel(AbstractModel):
    """Explicit dynamic model, tau = D(q, qd, qdd) X (Eq. 5, 6)."""

    def B(self, state: State) -> Multipliers:
        """Return ones: a row for each joint."""
        return each_joint(state)

    def c(self, basis: Basis, state: State) -> Columns:
        """Return D(q, qd, qdd)."""
        return basis.explicit(state)

    def e(self, basis: Basis, state: State) -> Columns:
        """Return no columns."""
        del basis, state
        return {}
