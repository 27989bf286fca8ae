"""Where the rows of an operator lie, and windows that slide from row to row."""

from dataclasses import dataclass
from math import ceil

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.errors import LogError


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
    sums, count, step = len(weights), grid.count, grid.step
    parts = -(-weights.shape[-1] // step)
    frames = count + parts - 1
    start, length = grid.first - before, frames * step
    stretch = x[..., start : start + length]
    if stretch.shape[-1] < length:  # beyond the last row's weights, where the parts are zero
        stretch = np.pad(stretch, [(0, 0)] * (x.ndim - 1) + [(0, length - stretch.shape[-1])])
    cut = np.swapaxes(stretch.reshape(*x.shape[:-1], frames, step), -1, -2).reshape(*x.shape[:-2], -1, frames)
    padded = np.zeros((*weights.shape[:2], parts * step))
    padded[..., : weights.shape[-1]] = weights
    split = np.swapaxes(padded.reshape(sums, -1, parts, step), 1, 2).reshape(sums * parts, -1)
    products = np.matmul(split, cut).reshape(*x.shape[:-2], sums, parts, frames)
    total = products[..., 0, :count].copy()
    for i in range(1, parts):
        total += products[..., i, i : i + count]
    return total
