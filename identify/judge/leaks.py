"""Samples of a held-out log that a fit has seen: what they say of a model is worth nothing."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from idbench.identify.data.log_columns import LogColumns
from idbench.identify.data.motion_log import MotionLog


def seen(held_out: MotionLog | LogColumns, fitted: Sequence[MotionLog | LogColumns]) -> int:
    """Return how many samples of a log, in which a joint moves, are also in another: equal positions and torques.

    A robot that rests repeats its readings; noise of the torques tells other samples apart. Logs that were put on another clock
    do not have their samples any more: give the columns of their files. Torques with a clock of their own are not compared.

    Parameters
    ----------
    held_out : MotionLog or LogColumns
        One run.
    fitted : sequence of MotionLog or LogColumns
        Those of the fit.
    """
    own = _keys(held_out)
    moving = np.zeros(len(own), dtype=bool)
    moving[1:] = (np.diff(held_out.q, axis=0) != 0).any(axis=1)
    others = np.concatenate([keys for keys in map(_keys, fitted) if keys.dtype == own.dtype] or [own[:0]])
    return int(np.isin(own, others)[moving].sum())


def _keys(log: MotionLog | LogColumns) -> npt.NDArray[np.void]:
    """Return the samples of a log as values that can be compared whole, shape (time,)."""
    parts = [log.q, log.tau] if len(log.tau) == len(log.q) else [log.q]
    rows = np.ascontiguousarray(np.concatenate(parts, axis=1)) + 0.0  # -0 is 0
    return rows.view([("", rows.dtype)] * rows.shape[1]).ravel()
