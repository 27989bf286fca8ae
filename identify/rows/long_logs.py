"""Logs too long for their rows to be kept, which are made piece by piece."""

from collections.abc import Sequence

from idbench.identify.data.motion_log import MotionLog

PIECE = 6e5
"""Samples times joints squared of a piece: columns grow with the joints squared, and take some 100 MB."""

LONG = 1e7
"""Samples times joints squared, of all logs of a fit, beyond which rows are not kept."""


def is_long(logs: Sequence[MotionLog]) -> bool:
    """Return whether the rows of a fit are too many to be kept."""
    return all(log.q.ndim == 2 for log in logs) and _size(logs) > LONG


def manageable(logs: Sequence[MotionLog]) -> list[MotionLog]:
    """Return logs, or the beginning of each where their rows would be too many to be kept."""
    share = LONG / _size(logs)
    return [log.part(0, int(share * log.samples)) for log in logs] if is_long(logs) else list(logs)


def piece_of(log: MotionLog) -> int:
    """Return the samples of a piece of a log."""
    return int(PIECE / log.n**2)


def _size(logs: Sequence[MotionLog]) -> int:
    return sum(log.samples * log.n**2 for log in logs)
