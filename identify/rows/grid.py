"""Where the rows of an operator lie, and windows that slide from row to row."""

from dataclasses import dataclass
from math import ceil

import numpy as np

from identify.arrays import Array
from identify.errors import LogError


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
    """The weights of the samples k - before, k - before + 1, ... in the row of sample k, for the rows of a grid.

    Only the rows are computed: cut into frames of `step` samples, each is the sum of a few neighbouring frames, multiplied with
    their parts of the weights. (Nine times faster than `scipy.signal.upfirdn`.)

    Parameters
    ----------
    weights : Array, shape (length,)
        What a sample is multiplied by.
    before : int
        Samples ahead of the row's own that it looks at.
    grid : Grid
        The rows.
    """

    weights: Array
    before: int
    grid: Grid

    @property
    def _parts(self) -> Array:
        """The weights in frames, shape (frame of a row, step), padded with zeros."""
        step = self.grid.step
        return np.pad(self.weights, (0, -len(self.weights) % step)).reshape(-1, step)

    def apply(self, x: Array) -> Array:
        """Return the weighted sums of `x`, shape (..., time), at the rows, shape (..., count)."""
        parts, count = self._parts, self.grid.count
        frames = count + len(parts) - 1
        start, length = self.grid.first - self.before, frames * self.grid.step
        stretch = x[..., start : start + length]
        if stretch.shape[-1] < length:  # beyond the last row's weights, where the parts are zero
            stretch = np.pad(stretch, [(0, 0)] * (x.ndim - 1) + [(0, length - stretch.shape[-1])])
        cut = np.swapaxes(stretch.reshape(*x.shape[:-1], frames, self.grid.step), -1, -2)
        products = np.matmul(parts, cut)
        sums = products[..., 0, :count].copy()
        for i in range(1, len(parts)):
            sums += products[..., i, i : i + count]
        return sums

    def adjoint(self, rows: Array, samples: int) -> Array:
        """Return what each of `samples` samples counts for in sums of `rows`, shape (..., count), over the rows."""
        parts, count, start = self._parts, self.grid.count, self.grid.first - self.before
        beside = len(parts) - 1
        padded = np.pad(rows, [(0, 0)] * (rows.ndim - 1) + [(beside, beside)])
        # Frame f is made of the rows f - beside ... f, the last with the first part of the weights.
        near = np.stack([padded[..., i : i + count + beside] for i in range(len(parts))], axis=-1)
        frames = np.matmul(near, parts[::-1])
        spread = np.zeros((*rows.shape[:-1], samples))
        end = min(samples, start + (count + beside) * self.grid.step)
        spread[..., start:end] = frames.reshape(*rows.shape[:-1], -1)[..., : end - start]
        return spread
