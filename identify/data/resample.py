"""Logs whose times are not uniform, made uniform."""

from dataclasses import replace

import numpy as np
import scipy

from identify.arrays import Array
from identify.data.motion_log import MotionLog, TorqueChannel
from identify.errors import LogError, require_positive

MOST_SAMPLES = 1e8
"""Samples above which a frequency is taken for a slip."""


def resample(t: Array, q: Array, tau: Array, torque: TorqueChannel, fs: float) -> MotionLog:
    """Return a log at `fs` [Hz] of samples at any increasing times.

    Positions by a cubic spline; torques by straight lines, or, where they are held, by the mean of what is held over each new
    period: the new log's torque is then `averaged`, with the same delay.

    Parameters
    ----------
    t : Array, shape (time,)
        [s], increasing.
    q, tau : Array, shape (time, joint)
        [rad], [N m].
    torque : TorqueChannel
        What the torque means.
    fs : float
        [Hz].

    Raises
    ------
    LogError
        If there are fewer than 4 samples, a value is not finite, or times do not increase.
    """
    require_positive(fs=fs)
    if len(t) < 4 or not all(np.isfinite(x).all() for x in (t, q, tau)):
        raise LogError(f"{len(t)} samples: at least 4 are needed, without NaN or infinity")
    if (step := np.diff(t)).min() <= 0:
        k = int(np.argmin(step))
        raise LogError(f"time does not increase: t = {t[k]:.9g} s is followed by {t[k + 1]:.9g} s at sample {k + 1}")
    count = int((t[-1] - t[0]) * fs + 1e-9)
    if not 1 <= count <= MOST_SAMPLES:
        raise LogError(f"fs = {fs:g} Hz makes {count:.3g} samples of {t[-1] - t[0]:.3g} s; 1 to {MOST_SAMPLES:.0e} are allowed")
    at = t[0] + np.arange(count + 1) / fs
    positions: Array = np.asarray(scipy.interpolate.CubicSpline(t, q)(at[:-1]), dtype=np.float64)
    if torque.meaning == "held":
        impulse = np.concatenate([np.zeros((1, q.shape[1])), np.cumsum(tau[:-1] * np.diff(t)[:, None], axis=0)])
        grown: Array = np.asarray(
            scipy.interpolate.interp1d(t, impulse, axis=0, fill_value="extrapolate")(at), dtype=np.float64
        )
        return MotionLog(fs, positions, np.diff(grown, axis=0) * fs, replace(torque, meaning="averaged"))
    between = scipy.interpolate.interp1d(t, tau, axis=0)(at[:-1])
    return MotionLog(fs, positions, np.asarray(between, dtype=np.float64), torque)
