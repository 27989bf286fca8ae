"""Integrals against a function of time: what windows and modulating functions have in common."""

from abc import abstractmethod
from typing import NamedTuple, final

import numpy as np

from identify.arrays import Array
from identify.balance import Balance
from identify.grid import Grid
from identify.operators.base import AbstractOperator, Rows


class Kernels(NamedTuple):
    """Weights of the samples k - before, k - before + 1, ... in the row of sample k."""

    integral: Array
    """Weights of B tau and c."""

    derivative: Array
    """Weights of e, which give the integral of s e without differentiating."""


class AbstractWeakForm(AbstractOperator):
    """Rows that are integrals over a stretch of time, s e integrated by parts, so that no velocity is differentiated.

    A stretch that touches a masked instant is left out whole, and one weight holds for the rest, the mean over it: weights
    inside a stretch would have to be differentiated too.
    """

    @abstractmethod
    def kernels(self, fs: float) -> Kernels:
        """Return the weights of both integrals, of equal length, for signals sampled at `fs` [Hz]."""

    @final
    def halo(self, fs: float) -> float:
        """Return half the length of a stretch."""
        return len(self.kernels(fs).integral) / 2 / fs

    @final
    def apply(self, balance: Balance, grid: Grid) -> Rows:
        """Return the integrals, weighted; a row is void if its stretch touches a masked instant."""
        kernels = self.kernels(balance.fs)
        length = len(kernels.integral)
        before = (length - 1) // 2
        columns = np.zeros((*balance.y.shape[:-2], len(balance.addresses), grid.count))
        for part, kernel in ((balance.c, kernels.integral), (balance.e, kernels.derivative)):
            if part:
                place = [balance.addresses.index(address) for address in part]
                columns[..., place, :] += grid.weighted_sums(np.stack(list(part.values()), axis=-2), kernel, before)
        touched = grid.weighted_sums((balance.weight == 0).astype(np.float64), np.ones(length), before)
        weight = grid.weighted_sums(balance.weight, np.full(length, 1 / length), before)
        row = [address[0] for address in balance.addresses]
        y = grid.weighted_sums(balance.y, kernels.integral, before)
        noise = weight * grid.weighted_sums(balance.noise, np.full(length, 1 / length), before)
        rows, ones = (weight * y, weight[..., row, :] * columns), np.ones_like(balance.weight)
        return Rows(*rows, noise, touched == 0, ones, weight, (length - 1) / 2 - before)

    @final
    def response(self, fs: float) -> Array:
        """Return the weights of B tau."""
        return self.kernels(fs).integral
