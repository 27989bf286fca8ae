"""What an operator is."""

from abc import ABC, abstractmethod
from typing import final

from idbench.identify.arrays import Array
from idbench.identify.models import Equations
from idbench.identify.rows.row_map import Grid, RowMap


class AbstractOperator(ABC):
    """A linear operator that turns B tau = [c + s e] X into rows of Y = W X + rho.

    It owns s, the weights and the decimation, and knows no robot.
    """

    @abstractmethod
    def step(self, fs: float) -> int:
        """Return how many samples lie between rows (n_d in the paper); raise SettingError if `fs` does not fit."""

    @abstractmethod
    def halo(self, fs: float) -> float:
        """Return how far [s] a row looks to either side of its sample."""

    @abstractmethod
    def response(self, fs: float) -> Array:
        """Return the weights of the samples around k in the row of sample k, shape (length,); k is (length - 1) // 2."""

    @abstractmethod
    def map(self, equations: Equations, weight: Array, grid: Grid) -> RowMap:
        """Return the linear map from samples, with weights of shape (..., kind of row, time), to the rows of `grid`."""

    @final
    def grid(self, samples: int, fs: float, trim: float) -> Grid:
        """Return where the rows of a log of `samples` lie, `trim` [s] away from both ends.

        Raises
        ------
        LogError
            If the log leaves no row.
        SettingError
            If a setting does not fit the log's sampling frequency.
        """
        return Grid.inside(samples, fs, trim, self.step(fs))
