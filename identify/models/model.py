"""What a model is."""

from abc import ABC, abstractmethod
from typing import final

import numpy as np

from idbench.identify.arrays import Columns, Multipliers
from idbench.identify.basis.basis import Basis
from idbench.identify.blame import expect
from idbench.identify.models.equations import Equations
from idbench.identify.signals.signals import Signals
from idbench.identify.signals.state import State


class AbstractModel(ABC):
    """An identification model B tau = [c + s e] X with s = d/dt: it takes B, c and e from a basis, and never filters."""

    @abstractmethod
    def B(self, state: State) -> Multipliers:
        """Return what torques are multiplied by, (row of an instant, joint) -> (..., time) or a constant, where it is not 0."""

    @abstractmethod
    def c(self, basis: Basis, state: State) -> Columns:
        """Return the columns that are used as they are."""

    @abstractmethod
    def e(self, basis: Basis, state: State) -> Columns:
        """Return the columns that are still to be differentiated."""

    @final
    def equations(self, basis: Basis, signals: Signals) -> Equations:
        """Return the model's equations at every sample, their columns averaged over the same windows as the torque."""
        state, average = signals.state, signals.torque.average
        shape = (*state.q.shape[:-2], state.q.shape[-1])
        B = {at: float(x) if np.ndim(x) == 0 else expect(self, "B", x, shape) for at, x in self.B(state).items()}
        return Equations(
            signals,
            B,
            {address: average(column) for address, column in self.c(basis, state).items()},
            {address: average(column) for address, column in self.e(basis, state).items()},
            basis.names,
        )


def each_joint(state: State) -> Multipliers:
    """Return B of a model that has the torque of every joint in a row of its own."""
    return {(j, j): 1.0 for j in range(state.n)}
