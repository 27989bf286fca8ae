"""What an operator is."""

from abc import ABC, abstractmethod
from typing import Any, final

import numpy as np
import numpy.typing as npt

from identify.arrays import Array
from identify.errors import SettingError
from identify.models.equations import Equations
from identify.rows.grid import Grid
from identify.rows.row_map import RowMap
from identify.rows.rows import Rows


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
    def lag(self, fs: float) -> float:
        """Return how long after its sample the middle of a row lies [s]."""
        length = len(self.response(fs))
        return ((length - 1) / 2 - (length - 1) // 2) / fs

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

    @final
    def rows(self, equations: Equations, grid: Grid) -> Rows:
        """Return Y = W X + rho at the rows of `grid`."""
        fs, n, p = equations.signals.fs, equations.kinds, len(equations.names)
        to_rows = self.map(equations, equations.weight, grid)
        y, columns = to_rows.apply(equations)
        _require_finite(columns, equations)
        parameter = [equations.names.index(name) for _, name in equations.addresses]
        W = np.zeros((*y.shape[:-2], n, p, grid.count))
        W[..., [row for row, _ in equations.addresses], parameter, :] = columns
        return Rows(
            Y=_flat(y),
            W=np.moveaxis(W, -1, -3).reshape(*y.shape[:-2], grid.count * n, p),
            valid=_flat(to_rows.outside > 0),
            time=np.repeat((grid.first + grid.step * np.arange(grid.count)) / fs + self.lag(fs), n),
            kinds=n,
            names=equations.names,
            maps=(to_rows,),
        )


def _flat(x: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return (..., kind, count) in the order of rows, (..., r)."""
    return np.swapaxes(x, -1, -2).reshape(*x.shape[:-2], -1)


def _require_finite(columns: Array, equations: Equations) -> None:
    """Raise SettingError that names the columns which are not finite."""
    if np.isfinite(columns).all():
        return
    finite = np.isfinite(columns).reshape(-1, *columns.shape[-2:])
    lost = [name for i, (_, name) in enumerate(equations.addresses) if not finite[:, i].all()]
    names = ", ".join(dict.fromkeys(lost))
    raise SettingError(f"the columns of {names} are not finite on this motion: correct the block that makes them")
