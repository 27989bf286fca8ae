"""No filter."""

from dataclasses import dataclass
from typing import final

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.rows.grid import Grid, Kernel
from idbench.identify.rows.operators.low_pass import AbstractLowPass
from idbench.identify.rows.row_map import Window


@final
@dataclass(frozen=True)
class Samples(AbstractLowPass):
    """No filter: every sample is a row, with all the noise that derivatives make."""

    def step(self, fs: float) -> int:
        """Return 1."""
        del fs
        return 1

    def halo(self, fs: float) -> float:
        """Return 0."""
        del fs
        return 0.0

    def window(self, fs: float, grid: Grid) -> Window:
        """Return the samples themselves."""
        return Kernel(self.response(fs), 0, grid)

    def response(self, fs: float) -> Array:
        """Return a single one."""
        del fs
        return np.ones(1)
