"""Logs whose times are not uniform, made uniform."""

import numpy as np
from scipy import interpolate

from identify.arrays import Array, require_positive
from identify.errors import LogError
from identify.motion_log import MotionLog, TorqueChannel


def resample(t: Array, q: Array, tau: Array, torque: TorqueChannel, fs: float) -> MotionLog:
    """Return a log at `fs` [Hz] of samples at any increasing times.

    Positions by a cubic spline; torques by straight lines, or, where they are held, by what is held.

    Parameters
    ----------
    t : Array, shape (time,)
        [s], increasing.
    q, tau : Array, shape (time, joint)
        [rad], [N m].
    torque : TorqueChannel
        What the torque means; the log's means the same.
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
    at = t[0] + np.arange(int((t[-1] - t[0]) * fs + 1e-9) + 1) / fs
    held = torque.meaning == "held"
    torques = interpolate.interp1d(t, tau, kind="previous" if held else "linear", axis=0, fill_value="extrapolate")
    positions: Array = np.asarray(interpolate.CubicSpline(t, q)(at), dtype=np.float64)
    return MotionLog(fs, positions, np.asarray(torques(at), dtype=np.float64), torque)
