"""A model's equations at every sample of a log."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from idbench.identify.arrays import HELD, Array, Columns, Multipliers, combined
from idbench.identify.signals.signals import Signals


@dataclass(frozen=True, eq=False)
class Equations:
    """B tau = [c + s e] X at every sample of a log, with s = d/dt."""

    signals: Signals
    """The log's."""
    B: Multipliers
    """(row of an instant, joint) -> what the row multiplies the torque of the joint by."""
    c: Columns
    """(row, place in X) -> column that is used as it is, and column that is still to be differentiated, shape (..., time)."""
    e: Columns
    """(row, place in X) -> column that is used as it is, and column that is still to be differentiated, shape (..., time)."""
    names: tuple[str, ...]
    """Names of the parameters X."""

    @property
    def kinds(self) -> int:
        """Number of rows at an instant."""
        return 1 + max(row for row, _ in self.B)

    @cached_property
    def y(self) -> Array:
        """B tau, shape (..., row, time): torques [N m] or power [W]."""
        q = self.signals.state.q
        total = np.zeros((*q.shape[:-2], self.kinds, q.shape[-1]))
        for (row, joint), B in self.B.items():
            total[..., row, :] += self.signals.torque.times(B, joint)
        return total

    @cached_property
    def weight(self) -> Array:
        """Weight of every row at every sample, shape (..., row, time)."""
        return self.weighted_as(self.signals.weight)

    def weighted_as(self, joints: Array) -> Array:
        """Return the weight of every row, shape (..., row, time), from weights of the joints, shape (..., joint, time).

        A row that takes a torque as it is has the weight of its joint, since friction jumps where the joint reverses. A row
        that multiplies it by the velocity has weight 1: the product is continuous there.
        """
        weight = np.ones((*joints.shape[:-2], self.kinds, joints.shape[-1]))
        for (row, joint), B in self.B.items():
            if isinstance(B, float):
                weight[..., row, :] *= joints[..., joint, :]
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
