"""The array type that every stage shares."""

from collections.abc import Mapping
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from idbench.identify.errors import SettingError

Array: TypeAlias = npt.NDArray[np.float64]

Columns: TypeAlias = Mapping[tuple[int, int], Array]
"""Columns of an observation matrix that are not identically zero: (row of an instant, place in X) -> signal (..., time)."""

TINY = 1e-300  # What a logarithm, or a division, takes for zero
HELD = -1  # In the place of a place in X: what torques have beside W X, the part of parameters that are known

Multipliers: TypeAlias = Mapping[tuple[int, int], Array | float]
"""B of a model, where it is not 0: (row of an instant, joint) -> what the row multiplies the torque of the joint by: a signal
(..., time), or a constant."""


def combined(columns: Columns, X: Array, total: Array) -> Array:
    """Add columns times their parameters X, shape (..., p), to `total`, shape (..., row, time); return it.

    Those that are held count once.
    """
    for (row, place), column in columns.items():
        total[..., row, :] += column if place == HELD else column * X[..., place, None]
    return total


def frozen(values: npt.ArrayLike) -> Array:
    """Return a read-only float64 copy, contiguous in memory."""
    given = np.asarray(values)
    if given.dtype.kind not in "fiub":
        raise SettingError(f"an array of {given.dtype} is given where real numbers are needed")
    array = np.array(given, dtype=np.float64, order="C")
    array.setflags(write=False)
    return array
