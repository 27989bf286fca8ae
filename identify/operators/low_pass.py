"""Low-pass and decimate: what the FIR and the IIR filter have in common."""

from abc import abstractmethod
from math import ceil, floor
from typing import final

import numpy as np

from identify.arrays import Array
from identify.balance import Balance
from identify.grid import Grid
from identify.operators.base import AbstractOperator, Rows


class AbstractLowPass(AbstractOperator):
    """The paper's parallel filter f_p (Eq. 15-19, 23): zero phase, the same for both sides, then one sample in n_d.

    e is differentiated at the acquisition rate, before the weights and the filter: differentiating the decimated
    signal, as Eq. 19 and 23 read literally, costs errors of 3 to 560 %.
    """

    @abstractmethod
    def decimate(self, x: Array, fs: float, grid: Grid) -> Array:
        """Return `x`, shape (..., time), low-passed, at the rows of `grid`."""

    @final
    def apply(self, balance: Balance, grid: Grid) -> Rows:
        """Return f_p of w B tau and of w (c + s e); a row is void if all it looks at is masked."""
        fs, n = balance.fs, balance.y.shape[-2]
        filtered = self.decimate(balance.weighted(), fs, grid)
        reach = ceil(self.halo(fs) * fs - 1e-9)
        near = np.ones(2 * reach + 1)
        seen = grid.weighted_sums(balance.weight, near, reach)
        noise = grid.weighted_sums(balance.noise, near / len(near), reach)
        return Rows(filtered[..., :n, :], filtered[..., n:, :], noise, seen > 0, balance.weight, np.ones_like(seen), 0.0)


def decimation(share: float, cutoff: float, fs: float) -> int:
    """Return n_d = share (fs/2) / cutoff of section 6.2, rounded down, at least 1."""
    return max(1, floor(share * fs / 2 / cutoff + 1e-9))  # 0.8 * 50 / 4 must not round down to 9
