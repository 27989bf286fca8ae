"""What a problem of logs too long for their rows to be kept makes of their pieces."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.data.motion_log import MotionLog
from idbench.identify.estimators.log_rows import LogRows
from idbench.identify.rows.chain import Chain
from idbench.identify.rows.factors import Factor, triangular
from idbench.identify.rows.long_logs import piece_of

MOVED = 0.02
"""Sigma by which what noise adds to W may move an estimate of long logs for it to be left there."""

Piece = tuple[Chain, MotionLog, tuple[int, int]]
"""A chain, a log, first sample and end of a piece of it."""


def pieces(chain: Chain, logs: Sequence[MotionLog]) -> list[Piece]:
    """Return every piece of logs, each with the chain whose mask is suited to the whole log."""
    suited = [replace(chain, mask=chain.mask.suited(_speeds(log, chain))) for log in logs]
    each = zip(suited, logs, strict=True)
    return [(own, log, piece) for own, log in each for piece in own.pieces(log, piece_of(log))]


def bias_counts(parts: Sequence[LogRows], names: tuple[str, ...], share: float) -> bool:
    """Return whether what noise adds to W moves the estimate of all rows, of which `parts` are a share, by over `MOVED`."""
    plain, better = (
        Factor(triangular(np.concatenate(rows)), np.array(0), names)
        for rows in (
            [part.whitening.whiten(part.rows.joined) for part in parts],
            [part.whitening.whiten(part.unbiased.joined) for part in parts],
        )
    )
    known = np.array(plain.determined & better.determined)
    sigma = np.sqrt(np.diagonal(better.inverse(known)) * share)
    return not (np.abs(plain.solution(known) - better.solution(known)) < MOVED * sigma).all()


def _speeds(log: MotionLog, chain: Chain) -> Array:
    """Return the velocities of a log, shape (joint, time), without anything else that its signals keep."""
    q = chain.prefilter.apply(np.ascontiguousarray(np.swapaxes(log.q, -1, -2)), log.fs)
    return chain.differentiator.derivative(q, log.fs)
