"""Identification models, and their table."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import ceil
from typing import final

import numpy as np

from idbench.identify.arrays import Array, Columns, Multipliers, combined
from idbench.identify.basis.basis import Basis
from idbench.identify.blame import expect
from idbench.identify.errors import SettingError
from idbench.identify.plugins import Table
from idbench.identify.signals.signals import Signals, State

STRETCH = 4096  # Samples whose columns are made at once where they are only summed: those of six joints then take 6 MB


@dataclass(frozen=True, eq=False)
class Equations:
    """B tau = [c + s e] X at every sample of a log, with s = d/dt."""

    signals: Signals
    """The log's."""
    B: Multipliers
    """(row of an instant, joint) -> what the row multiplies the torque of the joint by."""
    columns_of: Callable[[State], tuple[Columns, Columns]]
    """Motion -> c and e: (row, place in X) -> column, shape (..., time), used as it is, and still to be differentiated."""
    names: tuple[str, ...]
    """Names of the parameters X."""

    def columns(self, samples: slice) -> tuple[Columns, Columns]:
        """Return c and e at some samples, averaged over the same windows as the torque (at the ends as if motion stopped)."""
        c, e = self.columns_of(self.signals.state.part(samples))
        average = self.signals.torque.average
        return {at: average(column) for at, column in c.items()}, {at: average(column) for at, column in e.items()}

    @cached_property
    def differentiates(self) -> bool:
        """Whether there is an e."""
        return bool(self.columns(slice(0, 2))[1])

    @cached_property
    def reach(self) -> int:
        """Samples to either side that s and the windows of the columns look at."""
        fs = self.signals.fs
        return ceil((self.signals.differentiator.halo(fs) + self.signals.torque.halo()) * fs - 1e-9)

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

    def predicted(self, X: Array) -> Array:
        """Return (c + s e) X at every sample, shape (..., row, time), for parameters of shape (..., p)."""
        shape = self.y.shape
        plain, late = np.zeros((2, *np.broadcast_shapes(shape, (*X.shape[:-1], 1, 1))))
        for begin in range(0, shape[-1], STRETCH):
            inner = slice(begin, begin + STRETCH)
            seen = slice(max(0, begin - self.reach), begin + STRETCH + self.reach)
            own = slice(begin - seen.start, begin - seen.start + STRETCH)
            for total, columns in zip((plain, late), self.columns(seen), strict=True):
                there = combined(columns, X, np.zeros_like(total[..., seen]))
                total[..., inner] = there[..., own]
        return plain + self.signals.s(late)


def torque_rows(B: Multipliers, signals: Signals) -> Array:
    """Return B tau of signals, shape (..., row, time)."""
    q = signals.state.q
    total = np.zeros((*q.shape[:-2], 1 + max(row for row, _ in B), q.shape[-1]))
    for (row, joint), factor in B.items():
        total[..., row, :] += signals.torque.times(factor, joint)
    return total


class AbstractModel(ABC):
    """An identification model B tau = [c + s e] X with s = d/dt: it takes B, c and e from a basis, and never filters."""

    integrated: bool = False
    """Whether its rows are integrals over windows [ta, tb] of the chain's operator, or of 0.1 s where that makes none."""

    def B(self, state: State) -> Multipliers:
        """B, by which torques are multiplied, (row of an instant, joint) -> (..., time) or a constant, where it is not 0.

        By default 1, in a row for each joint.
        """
        return {(j, j): 1.0 for j in range(state.n)}

    @abstractmethod
    def c(self, basis: Basis, state: State) -> Columns:
        """Return the columns that are used as they are."""

    @abstractmethod
    def e(self, basis: Basis, state: State) -> Columns:
        """Return the columns that are still to be differentiated."""

    @final
    def equations(self, basis: Basis, signals: Signals) -> Equations:
        """Return the model's equations at every sample."""
        state = signals.state
        shape = (*state.q.shape[:-2], state.q.shape[-1])
        B = {at: float(x) if np.ndim(x) == 0 else expect(self, "B", x, shape) for at, x in self.B(state).items()}
        return Equations(signals, B, lambda motion: (self.c(basis, motion), self.e(basis, motion)), basis.names)


def rows_per_sample(model: AbstractModel, n: int) -> int:
    """Return the number of equations per sample for a robot of `n` joints: n, 1 for power, n + 1 for both."""
    still = np.zeros((n, 2))
    return 1 + max(row for row, _ in model.B(State(still, still, lambda x: x)))


def require_torques_once(model: AbstractModel, n: int) -> None:
    """Raise SettingError if rows of a model have torques of other rows: their covariance is then nearly singular."""
    still = np.zeros((n, 2))
    if len(model.B(State(still, still, lambda x: x))) > n:
        raise SettingError("rows of this model have the torques, and so the noise, of others: take estimator WLS or OLS")


@dataclass(frozen=True)
class ExplicitModel(AbstractModel):
    """Explicit dynamic model, tau = D(q, qd, qdd) X (Eq. 5, 6)."""

    def c(self, basis: Basis, state: State) -> Columns:
        """Return D(q, qd, qdd)."""
        return basis.explicit(state)

    def e(self, basis: Basis, state: State) -> Columns:
        """Return no columns."""
        return {}


@dataclass(frozen=True)
class ImplicitModel(AbstractModel):
    """Implicit dynamic model, tau = [R(q, qd) + s M_i(q) qd] X (Eq. 7-9)."""

    integrated: bool = False

    def c(self, basis: Basis, state: State) -> Columns:
        """Return R(q, qd)."""
        return basis.remainder(state)

    def e(self, basis: Basis, state: State) -> Columns:
        """Return M_i(q) qd."""
        return basis.momentum(state)


@dataclass(frozen=True)
class PowerModel(AbstractModel):
    """Power model, qd' tau = [qd' Gamma_f + s h(q, qd)] X (Eq. 10, 23); over windows, the energy model (Eq. 11, 20)."""

    integrated: bool = False

    def B(self, state: State) -> Multipliers:
        """Return qd': one row."""
        return {(0, j): state.qd[..., j, :] for j in range(state.n)}

    def c(self, basis: Basis, state: State) -> Columns:
        """Return the dissipated power."""
        return basis.dissipation(state)

    def e(self, basis: Basis, state: State) -> Columns:
        """Return the energies h(q, qd)."""
        return basis.energy(state)


def energy() -> PowerModel:
    """Energy model, int qd' tau dt = [int qd' Gamma_f dt + h(tb) - h(ta)] X (Eq. 11, 20): power over windows."""
    return PowerModel(integrated=True)


def integral() -> ImplicitModel:
    """Integral of the implicit model, int tau dt = [int R dt + M_i qd (tb) - M_i qd (ta)] X (after Eq. 9)."""
    return ImplicitModel(integrated=True)


@dataclass(frozen=True)
class ExplicitAndPowerModel(AbstractModel):
    """Explicit model and power as one more row, [tau; qd' tau] = [D; qd' Gamma_f + s h] X (Eq. 5, 6, 10), of the same noise."""

    def B(self, state: State) -> Multipliers:
        """Return 1, and below it qd'."""
        return {**super().B(state), **{(state.n, j): state.qd[..., j, :] for j in range(state.n)}}

    def c(self, basis: Basis, state: State) -> Columns:
        """Return D(q, qd, qdd), and below it the dissipated power."""
        return {**basis.explicit(state), **{(state.n, p): x for (_, p), x in basis.dissipation(state).items()}}

    def e(self, basis: Basis, state: State) -> Columns:
        """Return the energies h(q, qd), in the last row."""
        return {(state.n, p): x for (_, p), x in basis.energy(state).items()}


THREE = ("explicit", "implicit", "power")  # The paper's models, which are compared where no other is asked for

MODELS: Table[AbstractModel] = Table(
    "models",
    AbstractModel,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {
        "explicit": ExplicitModel,
        "implicit": ImplicitModel,
        "power": PowerModel,
        "energy": energy,
        "integral": integral,
        "explicit+power": ExplicitAndPowerModel,
    },
)
