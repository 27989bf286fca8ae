"""What an operator is."""

from abc import ABC, abstractmethod
from typing import NamedTuple, final

import numpy as np

from identify.arrays import Array
from identify.balance import Balance
from identify.carrier import Carrier
from identify.errors import SettingError
from identify.grid import Grid
from identify.kernel import Kernel
from identify.system import System


class Rows(NamedTuple):
    """Both sides of a model after an operator, at the rows of a grid."""

    y: Array
    """B tau, shape (..., row, count)."""

    columns: Array
    """c + s e in the order of the balance's addresses, shape (..., k, count)."""

    noise: Array
    """How noisy each row is, relative to others of its kind, shape (..., row, count)."""

    valid: np.typing.NDArray[np.bool_]
    """Whether the row says anything, shape (..., row, count)."""

    inside: Array
    """Weights of the samples of B tau before the operator, shape (..., row, time)."""

    outside: Array
    """Weights of the rows after it, shape (..., row, count)."""

    lag: float
    """Where the middle of a row lies after its sample, in samples."""


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
    def apply(self, balance: Balance, grid: Grid) -> Rows:
        """Return both sides of `balance` at the rows of `grid`."""

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
    def system(self, balance: Balance, grid: Grid) -> System:
        """Return Y = W X + rho at the rows of `grid`, ordered by time, then row (Eq. 14)."""
        fs, (*runs, n, _) = balance.fs, balance.y.shape
        rows = self.apply(balance, grid)
        _require_finite(rows, balance)
        valid, response = rows.valid, self.response(fs)
        kernel = Kernel(response, (len(response) - 1) // 2, grid)
        row = [address[0] for address in balance.addresses]
        parameter = [balance.parameters.index(address[1]) for address in balance.addresses]
        W = np.zeros((*runs, n, len(balance.parameters), grid.count))
        W[..., row, parameter, :] = rows.columns * valid[..., row, :]
        return System(
            Y=np.swapaxes(rows.y * valid, -1, -2).reshape(*runs, -1),
            W=np.moveaxis(W, -1, -3).reshape(*runs, grid.count * n, -1),
            noise=np.swapaxes(rows.noise, -1, -2).reshape(*runs, -1),
            valid=np.swapaxes(valid, -1, -2).reshape(*runs, -1),
            time=np.repeat((grid.first + grid.step * np.arange(grid.count) + rows.lag) / fs, n),
            group=np.tile(np.arange(n), grid.count),
            parameters=balance.parameters,
            carriers=(Carrier(balance.B, rows.inside, rows.outside * valid, kernel, balance.transposed, balance.reach),),
        )


def _require_finite(rows: Rows, balance: Balance) -> None:
    """Raise SettingError that names the columns which are not finite."""
    if np.isfinite(rows.columns).all():
        return
    finite = np.isfinite(rows.columns).reshape(-1, *rows.columns.shape[-2:])
    lost = [name for i, (_, name) in enumerate(balance.addresses) if not finite[:, i].all()]
    names = ", ".join(dict.fromkeys(lost))
    raise SettingError(f"the columns of {names} are not finite on this motion: correct the block that makes them")
