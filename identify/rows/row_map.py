"""The linear map from samples to rows."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import ceil
from typing import Protocol, Self

import numpy as np

from idbench.identify.arrays import Array, Multipliers
from idbench.identify.errors import LogError
from idbench.identify.signals.signals import Signals


@dataclass(frozen=True)
class Grid:
    """Rows at the samples first, first + step, ...: `count` of them."""

    first: int
    step: int
    count: int

    @classmethod
    def inside(cls, samples: int, fs: float, trim: float, step: int) -> "Grid":
        """Return the grid of a log of `samples`, `trim` [s] away from both ends; raise LogError if nothing is left."""
        first = ceil(trim * fs - 1e-9)  # the rounding of the product must not cost a sample
        count = (samples - 2 * first) // step
        if count < 1:
            raise LogError(
                f"the log has {samples} samples ({samples / fs:.4g} s); this chain drops {first} at either end and makes "
                f"a row of {step}, so it needs at least {2 * first + step}: use a longer log, or a chain with a shorter "
                "memory"
            )
        return cls(first, step, count)

    @property
    def samples(self) -> slice:
        """The samples of the rows."""
        return slice(self.first, self.first + self.step * self.count, self.step)


@dataclass(frozen=True, eq=False)
class Kernel:
    """The weights of the samples k - before, k - before + 1, ... in the row of sample k, for the rows of a grid."""

    weights: Array
    """What a sample is multiplied by, shape (length,)."""
    before: int
    """Samples ahead of the row's own that it looks at."""
    grid: Grid
    """The rows."""

    def apply(self, x: Array) -> Array:
        """Return the weighted sums of `x`, shape (..., time), at the rows, shape (..., count)."""
        return windowed(x[..., None, :], self.weights[None, None], self.before, self.grid)[..., 0, :]


def windowed(x: Array, weights: Array, before: int, grid: Grid) -> Array:
    """Return weighted sums, over all `s` and the samples k - before ..., at the rows of a grid, shape (..., sum, count).

    Only the rows are computed: cut into frames of `step` samples, each is the sum of a few neighbouring frames, multiplied with
    their parts of the weights. (Nine times faster than `scipy.signal.upfirdn`.)

    Parameters
    ----------
    x : Array, shape (..., s, time)
        Signals.
    weights : Array, shape (sum, s, length)
        What they are multiplied by.
    before : int
        Samples ahead of the row's own that the weights begin.
    grid : Grid
        The rows.
    """
    sums = len(weights)
    count = grid.count
    step = grid.step
    parts = -(-weights.shape[-1] // step)
    frames = count + parts - 1
    start, length = grid.first - before, frames * step
    stretch = x[..., start : start + length]
    if stretch.shape[-1] < length:  # beyond the last row's weights, where the parts are zero
        stretch = np.pad(stretch, [(0, 0)] * (x.ndim - 1) + [(0, length - stretch.shape[-1])])
    framed = np.swapaxes(stretch.reshape(*x.shape[:-1], frames, step), -2, -3).reshape(*x.shape[:-2], frames, -1)
    padded = np.zeros((*weights.shape[:2], parts * step))
    padded[..., : weights.shape[-1]] = weights
    split = np.swapaxes(padded.reshape(sums, -1, parts, step), 1, 2).reshape(sums * parts, -1)
    used = np.flatnonzero(split.any(axis=-1))  # products of two rows' windows are zero where only one of them lies
    products = np.matmul(split[used], np.swapaxes(framed, -1, -2))
    total = np.zeros((*x.shape[:-2], sums, count))
    for k, (which, part) in enumerate(zip(*np.divmod(used, parts), strict=True)):
        total[..., which, :] += products[..., k, part : part + count]
    return total


class Window(Protocol):
    """Weighted sums of samples at the rows of a grid, the same sums at every row."""

    def apply(self, x: Array) -> Array:
        """Return the sums of `x`, shape (..., time), shape (..., count)."""


OVERLAP = 4  # Least length of a stretch, over what is looked at beside it


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

    def stretches(self, samples: int, reach: int) -> Iterator[tuple[Self, slice, slice]]:
        """Yield the map of some rows after the other, with the samples that it takes and the places of its rows.

        A recursive filter looks at all samples, and stays whole.

        Parameters
        ----------
        samples : int
            Samples of a stretch; those that rows look at come on top of them.
        reach : int
            Samples to either side that are needed beyond those of the kernel.
        """
        kernel, grid = self.kernel, self.grid
        if not isinstance(kernel, Kernel):
            yield self, slice(None), slice(None)
            return
        length = max(len(x.weights) for x in (kernel, self.rate_kernel) if x)
        each = max(1, max(samples, OVERLAP * (length + 2 * reach)) // grid.step)
        for row in range(0, grid.count, each):
            count = min(each, grid.count - row)
            own = grid.first + row * grid.step
            begin = max(0, own - kernel.before - reach)
            seen = slice(begin, own + (count - 1) * grid.step - kernel.before + length + reach)
            there = Grid(own - begin, grid.step, count)
            rates = self.rate_kernel and replace(self.rate_kernel, grid=there)
            rows = slice(row, row + count)
            part = replace(
                self, grid=there, kernel=replace(kernel, grid=there), rate_kernel=rates, inside=self.inside[..., seen],
                outside=self.outside[..., rows],
            )  # fmt: skip
            yield part, seen, rows

    def measurement(self, y: Array) -> Array:
        """Return the rows of B tau, shape (..., kind, time), in the order of Y, shape (..., r)."""
        return in_order(self.outside * self.kernel.apply(self.inside * y))

    def noisy_as(self, other: Self) -> bool:
        """True if noise of the log reaches these rows as it does those of the map of another model."""
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
