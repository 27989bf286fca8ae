"""The implicit dynamic model."""

from dataclasses import dataclass
from typing import final

from idbench.identify.arrays import Columns, Multipliers
from idbench.identify.basis.basis import Basis
from idbench.identify.models.model import AbstractModel, each_joint
from idbench.identify.signals.state import State


@final
@dataclass(frozen=True)
class ImplicitModel(AbstractModel):
    """Implicit dynamic model, tau = [R(q, qd) + s M_i(q) qd] X (Eq. 7-9)."""

    def B(self, state: State) -> Multipliers:
        """Return ones: a row for each joint."""
        return each_joint(state)

    def c(self, basis: Basis, state: State) -> Columns:
        """Return R(q, qd)."""
        return basis.remainder(state)

    def e(self, basis: Basis, state: State) -> Columns:
        """Return M_i(q) qd."""
        return basis.momentum(state)
