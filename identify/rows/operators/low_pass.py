"""Low-pass and decimate: what the FIR and the IIR filter have in common."""

from abc import abstractmethod
from math import ceil, floor
from typing import final

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.models.equations import Equations
from idbench.identify.rows.grid import Grid, Kernel
from idbench.identify.rows.operators.operator import AbstractOperator
from idbench.identify.rows.row_map import RowMap, Window


class AbstractLowPass(AbstractOperator):
    """The paper's parallel filter f_p (Eq. 15-19, 23): zero phase, the same for both sides, then one sample in n_d.

    e is differentiated at the acquisition rate, before the weights and the filter: differentiating the decimated
    signal, as Eq. 19 and 23 read literally, costs errors of 3 to 560 %.
    """

    @abstractmethod
    def window(self, fs: float, grid: Grid) -> Window:
        """Return the filter at the rows of `grid`."""

    @final
    def map(self, equations: Equations, weight: Array, grid: Grid) -> RowMap:
        """Return f_p of w B tau and of w (c + s e); a row is void if all it looks at is masked."""
        fs = equations.signals.fs
        reach = ceil(self.halo(fs) * fs - 1e-9)
        seen = Kernel(np.ones(2 * reach + 1), reach, grid).apply(weight)
        valid = (seen > 0).astype(np.float64)
        return RowMap(equations.signals, equations.B, grid, self.window(fs, grid), None, weight, valid, self.response(fs))


def decimation(share: float, cutoff: float, fs: float) -> int:
    """Return n_d = share (fs/2) / cutoff of section 6.2, rounded down, at least 1."""
    return max(1, floor(share * fs / 2 / cutoff + 1e-9))  # 0.8 * 50 / 4 must not round down to 9
