"""The rows of Y = W X + rho."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from idbench.identify.arrays import HELD, Array
from idbench.identify.data.motion_log import MotionLog
from idbench.identify.errors import LogError, SettingError
from idbench.identify.models import Equations
from idbench.identify.rows.factors import Factors, triangular
from idbench.identify.rows.row_map import RowMap, in_order

BYTES = 1.6e7  # Of columns that are made at once: they stay in a cache, and little of a log is looked at twice
LONG = 1e7  # Samples times joints squared, of all logs of a fit, beyond which rows are not kept


def is_long(logs: Sequence[MotionLog]) -> bool:
    """True if the rows of a fit are too many to be kept."""
    return all(log.q.ndim == 2 for log in logs) and _size(logs) > LONG


def manageable(logs: Sequence[MotionLog]) -> list[MotionLog]:
    """Return logs, or the beginning of each where their rows would be too many to be kept."""
    share = LONG / _size(logs)
    return [log.part(0, int(share * log.samples)) for log in logs] if is_long(logs) else list(logs)


def _size(logs: Sequence[MotionLog]) -> int:
    return sum(log.samples * log.n**2 for log in logs)


@dataclass(frozen=True, eq=False)
class Rows:
    """Y = W X + rho (Eq. 12): what an operator makes of a model's equations, ordered by time, then kind (Eq. 14).

    Leading axes are independent runs.
    """

    Y: Array
    """Measurement vector, shape (..., r)."""
    W: Array
    """Observation matrix, shape (..., r, p)."""
    valid: npt.NDArray[np.bool_]
    """False where a row is void (masked out); such rows of Y and W are zero, shape (..., r)."""
    time: Array
    """Instant of every row [s], shape (r,)."""
    kinds: int
    """Kinds of rows, each of which comes once at every instant: a kind for each joint, or one in the power model."""
    names: tuple[str, ...]
    """Names of X."""
    maps: tuple[RowMap, ...]
    """How the samples of each log become its rows."""

    def __post_init__(self) -> None:
        for values in (self.Y, self.W, self.valid, self.time):
            values.setflags(write=False)  # estimators of others share them with what judges these

    @classmethod
    def of(cls, equations: Equations, to_rows: RowMap) -> Self:
        """Return the rows that a map makes of a model's equations; raise SettingError where its columns are not finite."""
        n, p = equations.kinds, len(equations.names)
        count = to_rows.grid.count
        y = to_rows.kernel.apply(to_rows.inside * equations.y) * to_rows.outside
        W = np.zeros((*y.shape[:-2], count, n, p))
        # Of each run, however many there are: other stretches might have other bits.
        for part, samples, rows in to_rows.stretches(int(BYTES / (W.itemsize * n * p)), equations.reach):
            places, columns = _mapped(equations, part, samples)
            own = places[:, 1] != HELD
            W[..., rows, places[own, 0], places[own, 1]] = np.swapaxes(columns[..., own, :], -1, -2)
            y[..., places[~own, 0], rows] -= columns[..., ~own, :]
        W = W.reshape(*y.shape[:-2], count * n, p)
        time, valid = np.repeat(to_rows.time, n), in_order(to_rows.outside) > 0
        return cls(in_order(y), W, valid, time, n, equations.names, (to_rows,))

    @property
    def group(self) -> npt.NDArray[np.intp]:
        """Kind of every row: the joint, from 0, or 0 for all rows of the power model, shape (r,)."""
        return np.tile(np.arange(self.kinds), len(self.time) // self.kinds)

    @property
    def joined(self) -> Array:
        """[W Y], shape (..., r, p + 1)."""
        return np.concatenate([self.W, self.Y[..., None]], axis=-1)

    @cached_property
    def count(self) -> npt.NDArray[np.intp]:
        """Number of rows of every kind that are not void, shape (..., kind)."""
        return np.sum(self.by_kind(self.valid), axis=-1)

    def by_kind(self, x: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Return values of all rows, shape (..., r), as (..., kind, instant)."""
        return np.swapaxes(x.reshape(*x.shape[:-1], -1, self.kinds), -1, -2)

    @cached_property
    def factors(self) -> Factors:
        """The triangular factors of [W Y], one for each kind."""
        return self.factors_of(None)

    def factors_of(self, weights: Array | None) -> Factors:
        """Return the triangular factors of rows multiplied by `weights`, shape (..., r), or as they are."""
        joined = self.joined_by_kind
        if weights is not None:
            joined *= self.by_kind(weights)[..., None]
        return Factors(triangular(joined), self.count, self.names)

    @property
    def joined_by_kind(self) -> Array:
        """[W Y] of each kind, shape (..., kind, instant, p + 1)."""
        p = self.W.shape[-1]
        joined = np.empty((*self.Y.shape[:-1], self.kinds, len(self.time) // self.kinds, p + 1))
        joined[..., :p] = np.swapaxes(self.W.reshape(*self.W.shape[:-2], -1, self.kinds, p), -2, -3)
        joined[..., p] = self.by_kind(self.Y)
        return joined

    def predicted(self, X: Array) -> Array:
        """Return W X, shape (..., r)."""
        return np.matmul(self.W, X[..., None])[..., 0]

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


def _mapped(equations: Equations, to_rows: RowMap, samples: slice) -> tuple[npt.NDArray[np.intp], Array]:
    """Return (row, place in X) of the columns c + s e, shape (k, 2), and what a map makes of them, shape (..., k, count).

    Raises
    ------
    SettingError
        If a column is not finite.
    """
    c, e = equations.columns(samples)
    by_parts = to_rows.rate_kernel
    late = np.stack(list(e.values()), axis=-2) if e else None
    parts = [c]
    if late is not None and by_parts is None:
        rates = equations.signals.s(late)
        parts.append({place: rates[..., i, :] for i, place in enumerate(e)})
    places = list(dict.fromkeys((*c, *e)))
    both = np.zeros((*equations.y.shape[:-2], len(places), to_rows.inside.shape[-1]))
    for i, place in enumerate(places):
        if found := [columns[place] for columns in parts if place in columns]:
            np.multiply(sum(found[1:], start=found[0]), to_rows.inside[..., place[0], :], out=both[..., i, :])
    columns = to_rows.kernel.apply(both)
    if late is not None and by_parts is not None:
        columns[..., [places.index(place) for place in e], :] += by_parts.apply(late)
    _require_finite(columns, places, equations.names)
    where = np.array(places, dtype=np.intp).reshape(-1, 2)
    return where, columns * to_rows.outside[..., where[:, 0], :]


def _require_finite(columns: Array, places: Sequence[tuple[int, int]], names: Sequence[str]) -> None:
    """Raise SettingError that names the columns which are not finite."""
    if np.isfinite(columns).all():
        return
    finite = np.isfinite(columns).reshape(-1, *columns.shape[-2:])
    lost = [place for i, (_, place) in enumerate(places) if not finite[:, i].all()]
    which = ", ".join(dict.fromkeys("what is known" if place == HELD else names[place] for place in lost))
    raise SettingError(f"the columns of {which} are not finite on this motion: correct the block that makes them")
