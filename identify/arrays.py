"""The array type and the checks that every stage shares."""

from collections.abc import Mapping
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from identify.errors import SettingError

Array: TypeAlias = npt.NDArray[np.float64]

Columns: TypeAlias = Mapping[tuple[int, str], Array]
"""Columns of an observation matrix that are not identically zero: (row of an instant, parameter) -> signal (..., time)."""


def frozen(values: npt.ArrayLike) -> Array:
    """Return a read-only float64 copy, contiguous in memory."""
    array = np.array(values, dtype=np.float64, order="C")
    array.setflags(write=False)
    return array


def require_positive(**settings: float) -> None:
    """Raise SettingError unless every setting is a finite number above zero."""
    for name, value in settings.items():
        if not (np.isfinite(value) and value > 0):
            raise SettingError(f"{name} = {value:g} must be a finite number above 0")


def require_below_nyquist(name: str, frequency: float, fs: float) -> None:
    """Raise SettingError unless `frequency` [Hz] is below half of `fs` [Hz]."""
    if frequency >= fs / 2:
        raise SettingError(
            f"{name} = {frequency:g} Hz is not below the Nyquist frequency, {fs / 2:g} Hz, of a log at fs = {fs:g} Hz: "
            "lower it, or log faster"
        )
