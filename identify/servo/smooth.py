"""Smoothed motion: what rows, and the loads of an arm, are made of."""

import numpy as np
from scipy.signal import butter, sosfiltfilt

from identify.arrays import Array

CUTOFF = 1 / 12
"""Cut-off of the low-pass, as a share of the sampling frequency: motion lies below, differentiated counts above."""

SECTIONS = butter(2, 2 * CUTOFF, output="sos")


def low_passed(x: Array) -> Array:
    """Return signals of a uniform clock, shape (time, ...), without what lies above the cut-off; none is late."""
    return np.asarray(sosfiltfilt(SECTIONS, x, axis=0))


def smoothed(t: Array, q: Array) -> tuple[Array, Array, Array]:
    """Return smoothed positions, velocities and accelerations at the times of a log, shape (time, joint)."""
    T = float(np.median(np.diff(t)))
    clock = np.arange(t[0], t[-1] + T / 2, T)
    uniform = low_passed(np.stack([np.interp(clock, t, x) for x in q.T], axis=1))
    qd = np.gradient(uniform, T, axis=0)
    motion = (uniform, qd, np.gradient(qd, T, axis=0))
    smooth, speed, acceleration = (np.stack([np.interp(t, clock, y) for y in x.T], axis=1) for x in motion)
    return smooth, speed, acceleration


def differentiated(t: Array, q: Array) -> tuple[Array, Array, Array]:
    """Return exact positions, shape (time,), with their velocities, and their accelerations about each sample."""
    steps = np.diff(t)
    acceleration = np.diff(np.diff(q) / steps) / ((steps[1:] + steps[:-1]) / 2)
    return q, np.gradient(q, t), np.pad(acceleration, 1, mode="edge")
