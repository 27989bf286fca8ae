"""Lanes of states: what a joint does, what its drive does, and what identification makes of the instant."""

import numpy as np
import numpy.typing as npt

from idbench.experiments.recording.columns import time_columns
from idbench.experiments.recording.stream import Stream
from idbench.identify import Array

STILL = 0.01
"""Share of the speed up to which a joint reverses, below which it rests: a 16-bit encoder shows one step of it in 0.1 s."""


class Lanes:
    """Lanes that grow; only changes are sent.

    Parameters
    ----------
    stream : Stream
        Where they go.
    fs : float
        Sampling frequency [Hz].
    """

    def __init__(self, stream: Stream, fs: float) -> None:
        self._stream, self._fs, self._last = stream, fs, dict[str, str]()

    def send(self, path: str, t: Array, states: npt.NDArray[np.str_]) -> None:
        """Send the states of a lane at the instants `t` [s]."""
        if path not in self._last:
            self._stream.lanes(path)
        now = np.concatenate([[self._last.get(path, "")], states])
        self._last[path] = str(now[-1])
        changed = np.flatnonzero(now[1:] != now[:-1])
        if len(changed):
            self._stream.states(path, time_columns(t[changed], self._fs), now[1 + changed].tolist())


def joint_states(qd: Array, slow: float, limited: Array | None, before: float) -> npt.NDArray[np.str_]:
    """Return what a joint does: it moves, reverses or rests, or its drive is at a limit, whatever it does.

    Parameters
    ----------
    qd : Array, shape (time,)
        Velocity [rad/s].
    slow : float
        Speed [rad/s] up to which it reverses.
    limited : Array, shape (time,), optional
        Share of each sample for which the drive was at its limit of current or voltage.
    before : float
        Velocity one sample before, or 0.
    """
    speed = np.abs(qd)
    reverses = np.concatenate([[before], qd[:-1]]) * qd < 0  # a fast joint reverses between two samples
    states = np.where(speed <= STILL * slow, "rests", np.where(reverses | (speed <= slow), "reverses", "moves"))
    return states if limited is None else np.where(limited > 0, "saturated", states)


def mask_states(weight: Array) -> npt.NDArray[np.str_]:
    """Return whether an instant is used, from its weight, shape (time,)."""
    return np.where(weight == 0, "masked", np.where(weight < 1, "partly", "used"))
