"""Logs too long for their rows to be kept: cut in time, their rows made and taken into triangular factors piece by piece."""

from collections.abc import Iterator, Sequence
from math import ceil
from typing import Protocol

from identify.basis import Basis
from identify.compression import compressed
from identify.grid import Grid
from identify.models import AbstractModel
from identify.motion_log import MotionLog
from identify.system import System

PIECE = 3e5
"""Samples times joints squared of a piece: columns grow with the joints squared, and take some 50 MB."""

LONG = 1e7
"""Samples times joints squared beyond which rows are not kept."""


class Builder(Protocol):
    """What of a chain is needed."""

    def rows(self, log: MotionLog) -> Grid:
        """Return where the rows of `log` lie."""

    def margin(self, log: MotionLog) -> float:
        """Return the time at either end of `log` that makes no rows [s]."""

    def build_each(self, log: MotionLog, basis: Basis, models: Sequence[AbstractModel]) -> list[System]:
        """Return the linear system of each model."""


def is_long(log: MotionLog | Sequence[MotionLog]) -> bool:
    """Return whether the rows of a log are too many to be kept."""
    return isinstance(log, MotionLog) and log.q.ndim == 2 and log.samples * log.n**2 > LONG


def manageable(log: MotionLog) -> MotionLog:
    """Return a log, or the beginning of one whose rows would be too many to be kept."""
    return log.part(0, int(LONG / log.n**2)) if is_long(log) else log


def pieces(chain: Builder, log: MotionLog) -> Iterator[MotionLog]:
    """Yield pieces of a log, each with what its rows look at, whose rows together are those of the log.

    `chain` must not trim more than it looks to either side.
    """
    for first, end in _spans(chain, log):
        yield log.part(first, end)


def _spans(chain: Builder, log: MotionLog) -> list[tuple[int, int]]:
    """Return the first sample of every piece, and that after its last."""
    grid, reach = chain.rows(log), ceil(chain.margin(log) * log.fs - 1e-9)
    rows = max(1, int(PIECE / log.n**2) // grid.step)
    starts = ((grid.first + row * grid.step - reach, min(rows, grid.count - row)) for row in range(0, grid.count, rows))
    return [(start, start + 2 * reach + count * grid.step) for start, count in starts]


def build_long(chain: Builder, log: MotionLog, basis: Basis, models: Sequence[AbstractModel]) -> list[System]:
    """Return the linear system of each model, compressed: as good as its rows for all of least squares."""
    found: list[System] = []
    for piece in pieces(chain, log):
        made = chain.build_each(piece, basis, models)
        joined = [System.stack([before, new]) for before, new in zip(found, made, strict=True)] if found else made
        found = [compressed(system) for system in joined]
    return found


def sampled(chain: Builder, log: MotionLog, count: int) -> list[MotionLog]:
    """Return `count` pieces of a log, evenly spread, or all if there are fewer."""
    spans = _spans(chain, log)
    return [log.part(*spans[i * len(spans) // min(count, len(spans))]) for i in range(min(count, len(spans)))]
