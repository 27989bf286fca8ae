"""Columns of a recording, made straight from arrays: a run that is watched sends twenty of them a second of its time."""

import re
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
import pyarrow as pa
import rerun as rr

from idbench.identify import Array

NANOSECONDS = 1_000_000_000  # In a second: the unit of rerun's times

SHOWN, POSES = 62.5, 31.25
"""Frequencies [Hz] above which curves, and poses of the arms, are thinned out: a minute on a screen has no more points."""


def shown(first: int, count: int, fs: float, most: float = SHOWN) -> np.typing.NDArray[np.bool_]:
    """Mask of the recorded samples among `count` from number `first` on, at a sampling frequency `fs` [Hz]."""
    return (first + np.arange(count)) % max(1, int(fs / most)) == 0


def part(name: str) -> str:
    """Return a name as part of an entity's path, in which slashes, spaces and the like mean something."""
    return re.sub(r"[^\w.-]+", "_", name)


def parts(names: Sequence[str]) -> list[str]:
    """Return names as parts of paths, each another one."""
    found = [part(name) for name in names]
    return [name if name not in found[:k] else f"{name}.{k + 1}" for k, name in enumerate(found)]


class TimeColumn:
    """A timeline's times, made once for all columns that share them."""

    def __init__(self, column: rr.TimeColumn) -> None:
        self._name, self._array = column.timeline_name(), column.as_arrow_array()

    def timeline_name(self) -> str:
        """Return the name of the timeline."""
        return self._name

    def as_arrow_array(self) -> "pa.Array[Any]":
        """Return the times."""
        return self._array


Times = Sequence[TimeColumn]


def time_columns(t: Array, fs: float) -> list[TimeColumn]:
    """Return the timelines sim_time (exact to 1 ns) and sample of the instants `t` [s]."""
    return [seconds(t), numbers("sample", np.rint(t * fs).astype(np.int64))]


def seconds(t: Array) -> TimeColumn:
    """Return the timeline sim_time alone, exact to 1 ns, for what lies between samples."""
    return TimeColumn(rr.TimeColumn("sim_time", duration=np.rint(t * NANOSECONDS).astype(np.int64).astype("timedelta64[ns]")))


def numbers(name: str, values: np.typing.NDArray[np.int64]) -> TimeColumn:
    """Return a timeline that counts."""
    return TimeColumn(rr.TimeColumn(name, sequence=values))


class ValueColumn(rr.ComponentColumn):
    """Values of one component, as rerun's own columns hold them: a row is a list of `count` of them.

    Parameters
    ----------
    like : rerun.ComponentColumn
        Tells the component and its type.
    values : Array
        Rows, one after the other.
    count : int
        Values of a row.
    """

    def __init__(self, like: rr.ComponentColumn, values: Array, count: int = 1) -> None:
        self.descriptor, inner = like.component_descriptor(), like.as_arrow_array().type.value_type
        if pa.types.is_fixed_size_list(inner):
            flat = pa.array(np.ascontiguousarray(values, dtype=inner.value_type.to_pandas_dtype()).ravel())
            items: Any = pa.FixedSizeListArray.from_arrays(flat, type=inner)  # type: ignore[call-overload]  # its stubs lack it
        else:
            items = pa.array(np.ascontiguousarray(values, dtype=inner.to_pandas_dtype()).ravel())
        self._array: pa.Array[Any] = pa.ListArray.from_arrays(_offsets(len(items), count), items)

    def component_descriptor(self) -> rr.ComponentDescriptor:
        """Descriptor of the component."""
        return self.descriptor

    def as_arrow_array(self) -> "pa.Array[Any]":
        """Return the rows."""
        return self._array


@lru_cache(maxsize=64)
def _offsets(items: int, count: int) -> Any:
    return pa.array(np.arange(0, items + 1, count, dtype=np.int32))


(_SCALARS,) = rr.Scalars.columns(scalars=[0.0])
_TRANSLATION, _QUATERNION = rr.Transform3D.columns(translation=[[0.0, 0.0, 0.0]], quaternion=[[0.0, 0.0, 0.0, 1.0]])


def scalars(values: Array) -> list[ValueColumn]:
    """Return curves of shape (time, curve) or (time,)."""
    return [ValueColumn(_SCALARS, values, values.shape[1] if values.ndim > 1 else 1)]


def poses(translation: Array, quaternion: Array) -> list[ValueColumn]:
    """Return poses: positions [m], shape (time, 3), and orientations x y z w, shape (time, 4)."""
    return [ValueColumn(_TRANSLATION, translation), ValueColumn(_QUATERNION, quaternion)]
