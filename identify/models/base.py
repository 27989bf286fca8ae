"""What a model is."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import final

from identify.arrays import Array, Columns
from identify.balance import Balance
from identify.basis import Basis
from identify.signals import Signals


class AbstractModel(ABC):
    """Picks B, c and e of B tau = [c + s e] X from a basis. It never filters."""

    @abstractmethod
    def y(self, signals: Signals) -> Array:
        """Return B tau, shape (..., row, time)."""

    @abstractmethod
    def c(self, basis: Basis, signals: Signals) -> Columns:
        """Return the columns that are used as they are."""

    @abstractmethod
    def e(self, basis: Basis, signals: Signals) -> Columns:
        """Return the columns that are still to be differentiated."""

    @abstractmethod
    def B(self, signals: Signals) -> Mapping[tuple[int, int], Array]:
        """Return what torques are multiplied by in `y`, (row of an instant, joint) -> (..., time), where it is not zero."""

    @abstractmethod
    def weight(self, signals: Signals) -> Array:
        """Return the weight of every row, shape (..., row, time)."""

    @abstractmethod
    def noise(self, signals: Signals) -> Array:
        """Return how noisy a row is at every instant, relative to its other instants, shape (..., row, time)."""

    @final
    def balance(self, basis: Basis, signals: Signals) -> Balance:
        """Return the model's sentence, its columns averaged over the same windows as the torque."""
        average = signals.torque.average
        return Balance(
            y=self.y(signals),
            c={address: average(column) for address, column in self.c(basis, signals).items()},
            e={address: average(column) for address, column in self.e(basis, signals).items()},
            weight=self.weight(signals),
            noise=self.noise(signals),
            s=signals.state.s,
            B=self.B(signals),
            transposed=signals.transposed,
            reach=signals.reach,
            fs=signals.fs,
            parameters=basis.parameters,
        )
