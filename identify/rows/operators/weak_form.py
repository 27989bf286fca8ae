"""Integrals against a function of time: what windows and modulating functions have in common."""

from abc import abstractmethod
from typing import NamedTuple, final

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.models.equations import Equations
from idbench.identify.rows.grid import Grid, Kernel
from idbench.identify.rows.operators.operator import AbstractOperator
from idbench.identify.rows.row_map import RowMap


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
    def map(self, equations: Equations, weight: Array, grid: Grid) -> RowMap:
        """Return the integrals, weighted; a row is void if its stretch touches a masked instant."""
        kernels = self.kernels(equations.signals.fs)
        length = len(kernels.integral)
        before = (length - 1) // 2
        integral, derivative = (Kernel(kernel, before, grid) for kernel in kernels)
        touched = Kernel(np.ones(length), before, grid).apply((weight == 0).astype(np.float64))
        mean = Kernel(np.full(length, 1 / length), before, grid).apply(weight)
        outside = mean * (touched == 0)
        ones, by_parts = np.ones_like(weight), derivative if equations.e else None
        return RowMap(equations.signals, equations.B, grid, integral, by_parts, ones, outside, kernels.integral)

    @final
    def response(self, fs: float) -> Array:
        """Return the weights of B tau."""
        return self.kernels(fs).integral
