"""The linear map from samples to rows."""

from dataclasses import dataclass, replace
from typing import Protocol, Self

import numpy as np

from idbench.identify.arrays import Array, Multipliers
from idbench.identify.rows.grid import Grid, Kernel
from idbench.identify.signals.signals import Signals


class Window(Protocol):
    """Weighted sums of samples at the rows of a grid, the same sums at every row."""

    def apply(self, x: Array) -> Array:
        """Return the sums of `x`, shape (..., time), shape (..., count)."""


@dataclass(frozen=True, eq=False)
class RowMap:
    """The rows of one log as a linear function K of signals c and e (..., kind of row, time):

    rows = outside (kernel(inside c) + kernel(inside s e))        without a rate kernel
    rows = outside (kernel(c) + rate_kernel(e))                   with one, which integrates s e by parts
    """

    signals: Signals
    """The log's."""
    B: Multipliers
    """(kind of row, joint) -> what the model multiplies torques by."""
    grid: Grid
    """Where the rows lie."""
    kernel: Window
    """Of what is used as it is."""
    rate_kernel: Kernel | None
    """Of what is still to be differentiated."""
    inside: Array
    """Weights of the samples; ones with a rate kernel, shape (..., kind, time)."""
    outside: Array
    """Weights of the rows, 0 for void ones, shape (..., kind, count)."""
    response: Array
    """Weights of the samples around k in the row of sample k, where `kernel` is recursive as far as its halo, shape
    (length,)."""

    @property
    def rows(self) -> int:
        """Number of rows, void ones included."""
        return self.outside.shape[-2] * self.outside.shape[-1]

    @property
    def time(self) -> Array:
        """Instant of the middle of what a row looks at [s], shape (count,)."""
        length = len(self.response)
        lag = ((length - 1) / 2 - (length - 1) // 2) / self.signals.fs
        return (self.grid.first + self.grid.step * np.arange(self.grid.count)) / self.signals.fs + lag

    @property
    def alike(self) -> bool:
        """Whether B is constant: noise of the torques is then the same in all rows of a kind, but for the mask."""
        return all(isinstance(B, float) for B in self.B.values())

    def unmasked(self) -> Self:
        """Return the map as if nothing were masked."""
        if (self.inside == 1).all() and (self.outside == 1).all():
            return self
        return replace(self, inside=np.ones_like(self.inside), outside=np.ones_like(self.outside))

    def measurement(self, y: Array) -> Array:
        """Return the rows of B tau, shape (..., kind, time), in the order of Y, shape (..., r)."""
        return in_order(self.outside * self.kernel.apply(self.inside * y))

    def noisy_as(self, other: Self) -> bool:
        """Return whether noise of the log reaches these rows as it does those of the map of another model."""
        if self is other:
            return True
        if (
            self.signals is not other.signals
            or self.grid != other.grid
            or not (self.alike and other.alike and self.B == other.B)
        ):
            return False
        plain = self.rate_kernel is None and other.rate_kernel is None
        return plain and np.array_equal(self.inside, other.inside) and np.array_equal(self.outside, other.outside)


def in_order(x: Array) -> Array:
    """Return values of rows, shape (..., kind, count), in the order of Y: by time, then kind, shape (..., r)."""
    return np.swapaxes(x, -1, -2).reshape(*x.shape[:-2], -1)
