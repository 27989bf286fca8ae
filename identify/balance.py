"""The sentence that every model says at every sample of a log."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from identify.arrays import Array, Columns


@dataclass(frozen=True, eq=False)
class Balance:
    """B tau = [c + s e] X at every sample, with s = d/dt.

    Parameters
    ----------
    y : Array, shape (..., row, time)
        B tau: torques [N m] or power [W].
    c : Columns
        Columns that are used as they are.
    e : Columns
        Columns that are still to be differentiated.
    weight : Array, shape (..., row, time)
        Weight of every row at every sample, between 0 and 1.
    noise : Array, shape (..., row, time)
        How noisy a row is, relative to the same row at other samples.
    s : callable
        d/dt along the last axis.
    B : mapping of (int, int) to Array, shape (..., time)
        (row, joint) -> what the row multiplies the joint's torque by.
    transposed : callable
        What has been done to the torques before, transposed.
    reach : int
        How many samples that looks to either side.
    fs : float
        [Hz].
    parameters : tuple of str
        Names of X.
    """

    y: Array
    c: Columns
    e: Columns
    weight: Array
    noise: Array
    s: Callable[[Array], Array]
    B: Mapping[tuple[int, int], Array]
    transposed: Callable[[Array], Array]
    reach: int
    fs: float
    parameters: tuple[str, ...]

    @cached_property
    def addresses(self) -> tuple[tuple[int, str], ...]:
        """(row, parameter) of every column of c + s e that is not identically zero; k of them."""
        return tuple(dict.fromkeys((*self.c, *self.e)))

    def weighted(self) -> Array:
        """Return y and then c + s e, times the weights of their rows, stacked to (..., row + k, time)."""
        n, rates = self.y.shape[-2], self._rates()
        both = np.empty((*self.y.shape[:-2], n + len(self.addresses), self.y.shape[-1]))
        np.multiply(self.y, self.weight, out=both[..., :n, :])
        for i, address in enumerate(self.addresses):
            parts = [columns[address] for columns in (self.c, rates) if address in columns]
            np.multiply(sum(parts[1:], start=parts[0]), self.weight[..., address[0], :], out=both[..., n + i, :])
        return both

    def predicted(self, X: Array) -> Array:
        """Return (c + s e) X at every sample, without weights, shape (..., row, time)."""
        total = np.zeros(self.y.shape)
        for columns in (self.c, self._rates()):
            for (row, parameter), column in columns.items():
                total[..., row, :] += column * X[..., self.parameters.index(parameter), None]
        return total

    def _rates(self) -> Columns:
        """Return s e, differentiated in one go."""
        if not self.e:
            return {}
        rates = self.s(np.stack(list(self.e.values()), axis=-2))
        return {address: rates[..., i, :] for i, address in enumerate(self.e)}
