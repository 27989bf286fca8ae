"""Where the rows of an operator lie, and weighted sums there."""

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

    def weighted_sums(self, x: Array, weights: Array, before: int) -> Array:
        """Return sum_j weights[j] x[k - before + j] at the samples k of the rows, shape (..., count).

        Only these are computed: cut into frames of `step` samples, every sum is that of a few neighbouring frames, each
        multiplied with its part of the weights. `before` samples must exist ahead of the first row, and
        len(weights) - before behind the last one.
        """
        parts = -(-len(weights) // self.step)
        frames = self.count + parts - 1
        W = np.zeros(parts * self.step)
        W[: len(weights)] = weights
        start, length = self.first - before, frames * self.step
        stretch = x[..., start : start + length]
        if stretch.shape[-1] < length:  # beyond the last row's weights, where W is zero
            pad = [(0, 0)] * (x.ndim - 1) + [(0, length - stretch.shape[-1])]
            stretch = np.pad(stretch, pad)
        cut = np.swapaxes(stretch.reshape(*x.shape[:-1], frames, self.step), -1, -2)
        products = np.matmul(W.reshape(parts, self.step), cut)
        sums = products[..., 0, : self.count].copy()
        for i in range(1, parts):
            sums += products[..., i, i : i + self.count]
        return sums
