"""Smoothed motion: what rows, and the loads of an arm, are made of."""

from functools import cache

import numpy as np
from scipy.signal import butter, sosfiltfilt

from idbench.identify.arrays import Array

CUTOFF = 1 / 12
"""Cut-off of the low-pass, as a share of the sampling frequency: motion lies below, differentiated counts above."""

DRIFT_CUTOFF = CUTOFF / 2
"""Cut-off of the residuals that correct a simulated motion, as a share of the sampling frequency.

Chosen on an arm of six whose servos were known exactly, to 3 % and to 10 %. Torques of the
joints were then off by 3, 9 and 30 mN m; by 4, 13 and 54 uncorrected, by 21 where positions were only measured."""


def low_passed(x: Array, cutoff: float = CUTOFF) -> Array:
    """Return signals of a uniform clock, shape (time, ...), without what lies above the cut-off; none is late."""
    return np.asarray(sosfiltfilt(_sections(cutoff), x, axis=0))


@cache
def _sections(cutoff: float) -> Array:
    return np.asarray(butter(2, 2 * cutoff, output="sos"))


def smoothed(t: Array, q: Array, cutoff: float = CUTOFF) -> tuple[Array, Array, Array]:
    """Return smoothed positions, velocities and accelerations at the times of a log, shape (time, joint)."""
    T = float(np.median(np.diff(t)))
    clock = np.arange(t[0], t[-1] + T / 2, T)
    uniform = low_passed(np.stack([np.interp(clock, t, x) for x in q.T], axis=1), cutoff)
    qd = np.gradient(uniform, T, axis=0)
    motion = (uniform, qd, np.gradient(qd, T, axis=0))
    smooth, speed, acceleration = (np.stack([np.interp(t, clock, y) for y in x.T], axis=1) for x in motion)
    return smooth, speed, acceleration


def corrected(t: Array, simulated: Array, measured: Array) -> tuple[Array, Array, Array]:
    """Return positions, velocities and accelerations of a simulated motion, shape (time,), corrected by the measured one.

    The residual is added below `DRIFT_CUTOFF`. Jolts, which encoder counts hide, come from the simulation, drift from neither.
    """
    steps = np.diff(t)
    acceleration = np.diff(np.diff(simulated) / steps) / ((steps[1:] + steps[:-1]) / 2)
    motion = (simulated, np.gradient(simulated, t), np.pad(acceleration, 1, mode="edge"))
    lacking = smoothed(t, (measured - simulated)[:, None], DRIFT_CUTOFF)
    q, qd, qdd = (x + y[:, 0] for x, y in zip(motion, lacking, strict=True))
    return q, qd, qdd
