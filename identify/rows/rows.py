"""The rows of Y = W X + rho."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
import numpy.typing as npt

from identify.arrays import Array
from identify.errors import LogError
from identify.rows.factors import Factors
from identify.rows.row_map import RowMap


@dataclass(frozen=True, eq=False)
class Rows:
    """Y = W X + rho (Eq. 12): what an operator makes of a model's equations, ordered by time, then kind (Eq. 14).

    Leading axes are independent runs.

    Parameters
    ----------
    Y : Array, shape (..., r)
        Measurement vector.
    W : Array, shape (..., r, p)
        Observation matrix.
    valid : bool array, shape (..., r)
        False where a row is void (masked out); such rows of Y and W are zero.
    time : Array, shape (r,)
        Instant of every row [s].
    kinds : int
        Kinds of rows, each of which comes once at every instant: a kind for each joint, or one in the power model.
    names : tuple of str
        Names of X.
    maps : tuple of RowMap
        How the samples of each log become its rows.
    """

    Y: Array
    W: Array
    valid: npt.NDArray[np.bool_]
    time: Array
    kinds: int
    names: tuple[str, ...]
    maps: tuple[RowMap, ...]

    @property
    def group(self) -> npt.NDArray[np.intp]:
        """Kind of every row: the joint, from 0, or 0 for all rows of the power model, shape (r,)."""
        return np.tile(np.arange(self.kinds), len(self.time) // self.kinds)

    @cached_property
    def count(self) -> npt.NDArray[np.intp]:
        """Number of rows of every kind that are not void, shape (..., kind)."""
        return np.sum(self.by_kind(self.valid), axis=-1)

    def by_kind(self, x: npt.NDArray[np.generic]) -> npt.NDArray[np.generic]:
        """Return values of all rows, shape (..., r), as (..., kind, instant)."""
        return np.swapaxes(x.reshape(*x.shape[:-1], -1, self.kinds), -1, -2)

    @cached_property
    def factors(self) -> Factors:
        """The triangular factors of [W Y], one for each kind."""
        return self.scaled_factors(None)

    def scaled_factors(self, scale: Array | None) -> Factors:
        """Return the triangular factors of rows multiplied by `scale`, shape (..., r), or as they are."""
        p = len(self.names)
        joined = np.empty((*self.Y.shape[:-1], self.kinds, len(self.time) // self.kinds, p + 1))
        joined[..., :p] = np.swapaxes(self.W.reshape(*self.W.shape[:-2], -1, self.kinds, p), -2, -3)
        joined[..., p] = self.by_kind(self.Y)
        if scale is not None:
            joined *= self.by_kind(scale)[..., None]
        return Factors.of(joined, self.count, self.names)

    def predicted(self, X: Array) -> Array:
        """Return W X, shape (..., r)."""
        return np.matmul(self.W, X[..., None])[..., 0]

    def of_log(self, k: int) -> slice:
        """Return which rows come from log `k`."""
        ends = np.cumsum([0, *(part.rows for part in self.maps)])
        return slice(int(ends[k]), int(ends[k + 1]))

    @classmethod
    def stack(cls, parts: Sequence[Self]) -> Self:
        """Return the rows of several logs as those of one fit: the paper's independent realizations."""
        first = parts[0]
        if len(parts) == 1:
            return first
        if any(part.names != first.names or part.Y.shape[:-1] != first.Y.shape[:-1] for part in parts):
            raise LogError("the logs of one fit must have the same parameters and the same number of runs")
        return cls(
            Y=np.concatenate([part.Y for part in parts], axis=-1),
            W=np.concatenate([part.W for part in parts], axis=-2),
            valid=np.concatenate([part.valid for part in parts], axis=-1),
            time=np.concatenate([part.time for part in parts]),
            kinds=first.kinds,
            names=first.names,
            maps=tuple(map_ for part in parts for map_ in part.maps),
        )
