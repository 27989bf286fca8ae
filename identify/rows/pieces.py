"""Logs too long for their rows to be kept: cut in time, so that their rows are made piece by piece."""

from collections.abc import Sequence
from math import ceil

from identify.data.motion_log import MotionLog
from identify.rows.chain import Chain

PIECE = 3e5
"""Samples times joints squared of a piece: columns grow with the joints squared, and take some 50 MB."""

LONG = 1e7
"""Samples times joints squared, of all logs of a fit, beyond which rows are not kept."""

SAMPLED = 8
"""Pieces of a long log from which noise is estimated and propagated."""


def is_long(logs: Sequence[MotionLog]) -> bool:
    """Return whether the rows of a fit are too many to be kept."""
    return all(log.q.ndim == 2 for log in logs) and sum(log.samples * log.n**2 for log in logs) > LONG


def manageable(logs: Sequence[MotionLog]) -> list[MotionLog]:
    """Return logs, or the beginning of each where their rows would be too many to be kept."""
    share = LONG / sum(log.samples * log.n**2 for log in logs)
    return [log.part(0, int(share * log.samples)) for log in logs] if is_long(logs) else list(logs)


def pieces(chain: Chain, logs: Sequence[MotionLog]) -> list[MotionLog]:
    """Return logs cut into pieces, each with the samples that its rows look at: their rows together are those of the logs."""
    found = []
    for log in logs:
        grid, reach = chain.grid(log), ceil(chain.margin(log) * log.fs - 1e-9)
        rows = max(1, int(PIECE / log.n**2) // grid.step)
        for row in range(0, grid.count, rows):
            start = grid.first + row * grid.step - reach
            found.append(log.part(start, start + 2 * reach + min(rows, grid.count - row) * grid.step))
    return found


def sampled(every: Sequence[MotionLog]) -> list[MotionLog]:
    """Return some of the pieces, evenly spread, or all if there are few."""
    count = min(SAMPLED, len(every))
    return [every[i * len(every) // count] for i in range(count)]
