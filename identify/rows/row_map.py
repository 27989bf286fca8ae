"""The linear map from samples to rows, and its adjoint."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from identify.arrays import Array
from identify.models.equations import Equations, Factors
from identify.rows.grid import Grid
from identify.rows.kernel import Kernel
from identify.signals.signals import Signals


class Window(Protocol):
    """Weighted sums of samples at the rows of a grid, the same sums at every row."""

    def apply(self, x: Array) -> Array:
        """Return the sums of `x`, shape (..., time), shape (..., count)."""

    def adjoint(self, rows: Array, samples: int) -> Array:
        """Return the adjoint at `rows`, shape (..., count), for `samples` samples."""


@dataclass(frozen=True, eq=False)
class RowMap:
    """The rows of one log as a linear function K of signals c and e (..., kind of row, time):

        rows = outside (kernel(inside c) + kernel(inside s e))        without a rate kernel
        rows = outside (kernel(c) + rate_kernel(e))                   with one, which integrates s e by parts

    Parameters
    ----------
    signals : Signals
        The log's.
    B : mapping of (int, int) to Array or float
        (kind of row, joint) -> what the model multiplies torques by.
    grid : Grid
        Where the rows lie.
    kernel : Window
        Of what is used as it is.
    rate_kernel : Kernel, optional
        Of what is still to be differentiated.
    inside : Array, shape (..., kind, time)
        Weights of the samples; ones with a rate kernel.
    outside : Array, shape (..., kind, count)
        Weights of the rows, 0 for void ones.
    response : Array, shape (length,)
        Weights of the samples around k in the row of sample k, where `kernel` is recursive as far as its halo.
    """

    signals: Signals
    B: Factors
    grid: Grid
    kernel: Window
    rate_kernel: Kernel | None
    inside: Array
    outside: Array
    response: Array

    @property
    def rows(self) -> int:
        """Number of rows, void ones included."""
        return self.outside.shape[-2] * self.outside.shape[-1]

    def apply(self, equations: Equations) -> tuple[Array, Array]:
        """Return the rows of B tau, shape (..., kind, count), and of the columns of c + s e, shape (..., k, count)."""
        by_parts = self.rate_kernel is not None
        parts = (equations.c,) if by_parts else (equations.c, equations.rates)
        kind = [address[0] for address in equations.addresses]
        both = self._weighted(equations, parts)
        filtered = self.kernel.apply(both)
        y, columns = filtered[..., : equations.kinds, :], filtered[..., equations.kinds :, :]
        if self.rate_kernel is not None and equations.e:
            place = [equations.addresses.index(address) for address in equations.e]
            columns[..., place, :] += self.rate_kernel.apply(np.stack(list(equations.e.values()), axis=-2))
        return y * self.outside, columns * self.outside[..., kind, :]

    def measurement(self, y: Array) -> Array:
        """Return the rows of B tau, shape (..., kind, time), in the order of Y, shape (..., r)."""
        rows = self.outside * self.kernel.apply(self.inside * y)
        return np.swapaxes(rows, -1, -2).reshape(*rows.shape[:-2], -1)

    def _weighted(self, equations: Equations, parts: tuple[Mapping[tuple[int, str], Array], ...]) -> Array:
        """Return B tau and then the sums of the columns of `parts`, times the weights of the samples."""
        n = equations.kinds
        both = np.zeros((*equations.y.shape[:-2], n + len(equations.addresses), equations.y.shape[-1]))
        np.multiply(equations.y, self.inside, out=both[..., :n, :])
        for i, address in enumerate(equations.addresses):
            found = [columns[address] for columns in parts if address in columns]
            if found:
                np.multiply(sum(found[1:], start=found[0]), self.inside[..., address[0], :], out=both[..., n + i, :])
        return both

    def adjoint(self, G: Array) -> tuple[Array, Array | None]:
        """Return the adjoint of K at sums of rows: what every sample of c, and of e, counts for in them.

        Parameters
        ----------
        G : Array, shape (..., rows, m)
            Weights of the rows in m sums.

        Returns
        -------
        tuple of Array
            Shape (..., m, kind, time) each; None for e without a rate kernel, as s e counts like c.
        """
        (*runs, kinds, count), samples = self.outside.shape, self.inside.shape[-1]
        rows = np.moveaxis(G.reshape(*runs, count, kinds, G.shape[-1]), (-3, -1), (-1, -3)) * self.outside[..., None, :, :]
        of_c = self.kernel.adjoint(rows, samples) * self.inside[..., None, :, :]
        return of_c, None if self.rate_kernel is None else self.rate_kernel.adjoint(rows, samples)
