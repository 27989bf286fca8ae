"""Samples of a held-out log that a fit has seen: what they say of a model is worth nothing."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from identify.data.motion_log import MotionLog


def seen(held_out: MotionLog, fitted: Sequence[MotionLog]) -> int:
    """Return how many samples of a log, in which a joint moves, are also in another: equal positions and torques.

    A robot that rests repeats its readings; noise of the torques tells other samples apart. Logs that were put on another clock
    do not have their samples any more: what was resampled shows no repetition.

    Parameters
    ----------
    held_out : MotionLog
        One run.
    fitted : sequence of MotionLog
        Those of the fit.
    """
    own = _keys(held_out)
    moving = np.zeros(len(own), dtype=bool)
    moving[1:] = (np.diff(held_out.q, axis=0) != 0).any(axis=1)
    others = np.concatenate([_keys(log) for log in fitted if log.n == held_out.n] or [own[:0]])
    return int(np.isin(own, others)[moving].sum())


def _keys(log: MotionLog) -> npt.NDArray[np.void]:
    """Return the samples of a log as values that can be compared whole, shape (time,)."""
    rows = np.ascontiguousarray(np.concatenate([log.q, log.tau], axis=1)) + 0.0  # -0 is 0
    return rows.view([("", rows.dtype)] * rows.shape[1]).ravel()
