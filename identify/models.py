"""Identification models, and their table."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, final

import numpy as np

from idbench.identify.arrays import HELD, Array, Columns, Multipliers, combined
from idbench.identify.basis.basis import Basis
from idbench.identify.blame import expect
from idbench.identify.plugins import Table
from idbench.identify.signals.signals import Signals, State


@dataclass(frozen=True, eq=False)
class Equations:
    """B tau = [c + s e] X at every sample of a log, with s = d/dt."""

    signals: Signals
    """The log's."""
    B: Multipliers
    """(row of an instant, joint) -> what the row multiplies the torque of the joint by."""
    c: Columns
    """(row, place in X) -> column that is used as it is, shape (..., time)."""
    e: Columns
    """(row, place in X) -> column that is still to be differentiated, shape (..., time)."""
    names: tuple[str, ...]
    """Names of the parameters X."""

    @property
    def kinds(self) -> int:
        """Number of rows at an instant."""
        return 1 + max(row for row, _ in self.B)

    @cached_property
    def y(self) -> Array:
        """B tau, shape (..., row, time): torques [N m] or power [W]."""
        return torque_rows(self.B, self.signals)

    @cached_property
    def weight(self) -> Array:
        """Weight of every row at every sample, shape (..., row, time)."""
        return self.weighted_as(self.signals.weight)

    def weighted_as(self, joints: Array) -> Array:
        """Return the weight of every row, shape (..., row, time), from weights of the joints, shape (..., joint, time).

        A row that takes a torque as it is has the weight of its joint, since friction jumps where the joint reverses. A row
        that multiplies it by the velocity has weight 1, the product is continuous there, or 0 if the torque was not logged.
        """
        weight = np.ones((*joints.shape[:-2], self.kinds, joints.shape[-1]))
        for (row, joint), B in self.B.items():
            if isinstance(B, float):
                weight[..., row, :] *= joints[..., joint, :]
            elif joint in self.signals.log.missing:
                weight[..., row, :] = 0.0
        return weight

    @cached_property
    def addresses(self) -> tuple[tuple[int, int], ...]:
        """(row, place in X) of every column of c + s e that is not zero at all times; k of them, those that are held first."""
        return tuple(sorted(dict.fromkeys((*self.c, *self.e)), key=lambda address: address[1] != HELD))

    @cached_property
    def rates(self) -> Columns:
        """The columns s e."""
        if not self.e:
            return {}
        rates = self.signals.s(np.stack(list(self.e.values()), axis=-2))
        return {address: rates[..., i, :] for i, address in enumerate(self.e)}

    def predicted(self, X: Array) -> Array:
        """Return (c + s e) X at every sample, shape (..., row, time), for parameters of shape (..., p)."""
        return combined(self.rates, X, combined(self.c, X, np.zeros(self.y.shape)))


def torque_rows(B: Multipliers, signals: Signals) -> Array:
    """Return B tau of signals, shape (..., row, time)."""
    q = signals.state.q
    total = np.zeros((*q.shape[:-2], 1 + max(row for row, _ in B), q.shape[-1]))
    for (row, joint), factor in B.items():
        total[..., row, :] += signals.torque.times(factor, joint)
    return total


class AbstractModel(ABC):
    """An identification model B tau = [c + s e] X with s = d/dt: it takes B, c and e from a basis, and never filters."""

    integrated: ClassVar[bool] = False
    """Whether its rows are integrals over windows, by whatever operator the chain has."""

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


def rows_per_sample(model: AbstractModel, n: int) -> int:
    """Return the number of equations per sample for a robot of `n` joints: n, or 1 for power."""
    still = np.zeros((n, 2))
    return 1 + max(row for row, _ in model.B(State(still, still, lambda x: x)))


def each_joint(state: State) -> Multipliers:
    """Return B of a model that has the torque of every joint in a row of its own."""
    return {(j, j): 1.0 for j in range(state.n)}


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


@final
@dataclass(frozen=True)
class OverWindows(AbstractModel):
    """Another model, integrated over windows [ta, tb] of the chain's operator, or of 0.1 s where that makes no integrals."""

    integrated: ClassVar[bool] = True

    of: AbstractModel
    """The model."""

    def B(self, state: State) -> Multipliers:
        """Return what the other model multiplies torques by."""
        return self.of.B(state)

    def c(self, basis: Basis, state: State) -> Columns:
        """Return the other model's columns, to be integrated."""
        return self.of.c(basis, state)

    def e(self, basis: Basis, state: State) -> Columns:
        """Return the other model's columns whose differences over a window are taken."""
        return self.of.e(basis, state)


def energy() -> OverWindows:
    """Energy model, int qd' tau dt = [int qd' Gamma_f dt + h(tb) - h(ta)] X (Eq. 11, 20): power over windows."""
    return OverWindows(PowerModel())


def integral() -> OverWindows:
    """Integral of the implicit model, int tau dt = [int R dt + M_i qd (tb) - M_i qd (ta)] X (after Eq. 9)."""
    return OverWindows(ImplicitModel())


THREE = ("explicit", "implicit", "power")
"""The paper's models, which are compared where no other is asked for."""

MODELS: Table[AbstractModel] = Table(
    "models",
    AbstractModel,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {
        "explicit": ExplicitModel,
        "implicit": ImplicitModel,
        "power": PowerModel,
        "energy": energy,
        "integral": integral,
    },
)
