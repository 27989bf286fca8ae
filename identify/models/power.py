"""The power model, which windows turn into the energy model."""

from dataclasses import dataclass
from typing import final

from idbench.identify.arrays import Columns, Multipliers
from idbench.identify.basis.basis import Basis
from idbench.identify.models.model import AbstractModel
from idbench.identify.signals.state import State


@final
@dataclass(frozen=True)
class PowerModel(AbstractModel):
    """Power model, qd' tau = [qd' Gamma_f + s h(q, qd)] X (Eq. 10, 23); over windows, the energy model (Eq. 11, 20)."""

    def B(self, state: State) -> Multipliers:
        """Return qd': one row."""
        return {(0, j): state.qd[..., j, :] for j in range(state.n)}

    def c(self, basis: Basis, state: State) -> Columns:
        """Return the dissipated power."""
        return basis.dissipation(state)

    def e(self, basis: Basis, state: State) -> Columns:
        """Return the energies h(q, qd)."""
        return basis.energy(state)
