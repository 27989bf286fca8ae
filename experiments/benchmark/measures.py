"""What the rows of a benchmark are judged by."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from idbench.identify import Array

Row = Mapping[str, Any]


@dataclass(frozen=True)
class Measure:
    """An error of held-out logs."""

    name: str
    """What summaries call it."""
    words: str
    """What it is."""
    over_logs: Callable[[Array], Array]
    """What is said of several logs, of shape (log, joint)."""


def rms(each: Array) -> Array:
    """Return the rms over logs, shape (joint,)."""
    return np.sqrt((each**2).mean(axis=0))


def mean(each: Array) -> Array:
    """Return the mean over logs, shape (joint,)."""
    found: Array = each.mean(axis=0)
    return found


TORQUE = Measure("torque_error_rms", "torque error on held-out logs, rms [N m, N]", rms)
POSITION = Measure("position_error", "position on held-out logs, from commands alone, mean absolute error [rad]", mean)


def measure_of(row: Row) -> Measure:
    """Return what a row is judged by."""
    return POSITION if any(POSITION.name in log for log in row["logs"]) else TORQUE


def pooled(logs: Sequence[Row], name: str, over_logs: Callable[[Array], Array] = rms) -> Array:
    """Return a figure of each joint over all logs that have it, shape (joint,); nothing if none has."""
    each = of_logs(logs, name)
    return over_logs(each) if len(each) else np.zeros(0)


def of_logs(logs: Sequence[Row], name: str) -> Array:
    """Return a figure of each log that has it and joint, shape (log, joint)."""
    return np.array([[np.nan if x is None else x for x in log[name]] for log in logs if name in log], dtype=float)
