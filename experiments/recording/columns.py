"""Columns of a recording, made straight from arrays: a run that is watched sends twenty of them a second of its time."""

import re
from collections.abc import Sequence

import numpy as np
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


Times = Sequence[rr.TimeColumn]


def time_columns(t: Array, fs: float) -> list[rr.TimeColumn]:
    """Return the timelines sim_time (exact to 1 ns) and sample of the instants `t` [s]."""
    return [seconds(t), rr.TimeColumn("sample", sequence=np.rint(t * fs).astype(np.int64))]


def seconds(t: Array) -> rr.TimeColumn:
    """Return the timeline sim_time alone, exact to 1 ns, for what lies between samples."""
    return rr.TimeColumn("sim_time", duration=np.rint(t * NANOSECONDS).astype(np.int64).astype("timedelta64[ns]"))


(_SCALARS,) = rr.Scalars.columns(scalars=[0.0])
_TRANSLATION, _QUATERNION = rr.Transform3D.columns(translation=[[0.0, 0.0, 0.0]], quaternion=[[0.0, 0.0, 0.0, 1.0]])


def scalars(values: Array) -> list[rr.ComponentColumn]:
    """Return curves of shape (time, curve) or (time,)."""
    offsets = np.arange(0, values.size + 1, values.shape[1] if values.ndim > 1 else 1, dtype=np.int32)
    return [rr.ComponentColumn(_SCALARS.descriptor, rr.components.ScalarBatch(values.ravel()), offsets=offsets)]


def poses(translation: Array, quaternion: Array) -> list[rr.ComponentColumn]:
    """Return poses: positions [m], shape (time, 3), and orientations x y z w, shape (time, 4)."""
    return [
        rr.ComponentColumn(_TRANSLATION.descriptor, rr.components.Translation3DBatch(translation)),
        rr.ComponentColumn(_QUATERNION.descriptor, rr.components.RotationQuatBatch(quaternion)),
    ]
