"""Logs too long for their rows to be kept: cut in time, their rows made and taken into triangular factors piece by piece."""

from collections.abc import Sequence
from math import ceil

from identify.basis import Basis
from identify.chain import Chain
from identify.compression import compressed
from identify.models import AbstractModel
from identify.motion_log import MotionLog
from identify.system import System

PIECE = 3e5
"""Samples times joints squared of a piece: columns grow with the joints squared, and take some 50 MB."""

LONG = 1e7
"""Samples times joints squared, of all logs of a fit, beyond which rows are not kept."""


def is_long(log: MotionLog | Sequence[MotionLog]) -> bool:
    """Return whether the rows of a fit are too many to be kept."""
    logs = [log] if isinstance(log, MotionLog) else list(log)
    return all(one.q.ndim == 2 for one in logs) and sum(one.samples * one.n**2 for one in logs) > LONG


def manageable(log: MotionLog) -> MotionLog:
    """Return a log, or the beginning of one whose rows would be too many to be kept."""
    return log.part(0, int(LONG / log.n**2)) if is_long(log) else log


def build_long(
    chain: Chain, log: MotionLog | Sequence[MotionLog], basis: Basis, models: Sequence[AbstractModel]
) -> list[System]:
    """Return the linear system of each model, compressed: as good as its rows for all of least squares."""
    found: list[System] = []
    for one, first, end in spans(chain, log):
        made = chain.build_each(one.part(first, end), basis, models)
        joined = [System.stack([before, new]) for before, new in zip(found, made, strict=True)] if found else made
        found = [compressed(system) for system in joined]
    return found


def spans(chain: Chain, log: MotionLog | Sequence[MotionLog]) -> list[tuple[MotionLog, int, int]]:
    """Return pieces of logs, each with what its rows look at: the log, the first sample, and that after the last.

    Their rows together are those of the logs.
    """
    found = []
    for one in [log] if isinstance(log, MotionLog) else log:
        grid, reach = chain.rows(one), ceil(chain.margin(one) * one.fs - 1e-9)
        rows = max(1, int(PIECE / one.n**2) // grid.step)
        for row in range(0, grid.count, rows):
            start = grid.first + row * grid.step - reach
            found.append((one, start, start + 2 * reach + min(rows, grid.count - row) * grid.step))
    return found


def sampled(chain: Chain, log: MotionLog | Sequence[MotionLog], count: int) -> list[MotionLog]:
    """Return `count` pieces, evenly spread, or all if there are fewer."""
    every = spans(chain, log)
    chosen = [every[i * len(every) // min(count, len(every))] for i in range(min(count, len(every)))]
    return [one.part(first, end) for one, first, end in chosen]
