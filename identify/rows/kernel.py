"""A window that slides from row to row of a grid, and its adjoint."""

from dataclasses import dataclass

import numpy as np

from identify.arrays import Array
from identify.rows.grid import Grid


@dataclass(frozen=True, eq=False)
class Kernel:
    """The weights of the samples k - before, k - before + 1, ... in the row of sample k, for the rows of a grid.

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

    def apply(self, x: Array) -> Array:
        """Return the weighted sums of `x`, shape (..., time), at the rows, shape (..., count)."""
        return self.grid.weighted_sums(x, self.weights, self.before)

    def adjoint(self, rows: Array, samples: int) -> Array:
        """Return what each of `samples` samples counts for in sums of `rows`, shape (..., count), over the rows."""
        step, count = self.grid.step, self.grid.count
        parts = -(-len(self.weights) // step)
        W = np.zeros((parts, step))
        W.ravel()[: len(self.weights)] = self.weights
        padded = np.zeros((*rows.shape[:-1], count + 2 * (parts - 1)))
        padded[..., parts - 1 : parts - 1 + count] = rows
        # Frame f is made of the rows f - parts + 1 ... f, the last with the first part of the kernel.
        near = np.stack([padded[..., i : i + count + parts - 1] for i in range(parts)], axis=-1)
        frames = np.matmul(near, W[::-1])
        start = self.grid.first - self.before
        spread = np.zeros((*rows.shape[:-1], samples))
        end = min(samples, start + (count + parts - 1) * step)
        spread[..., start:end] = frames.reshape(*rows.shape[:-1], -1)[..., : end - start]
        return spread
