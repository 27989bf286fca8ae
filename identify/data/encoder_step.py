"""The step of the encoders, found in the positions that they counted."""

import numpy as np

from idbench.identify.arrays import Array

OFF = 0.05
"""Share of a step by which a difference of positions may miss a whole number of steps: files are rounded."""

MIN_DIFFERENCES = 20
"""Differences that it takes."""

MAX_STEPS = 1000
"""Steps of a difference up to which rounding of the step itself does not matter."""


def encoder_steps(q: Array) -> Array:
    """Return the step of every joint's encoder [rad], shape (joint,); NaN where positions are no multiples of one.

    Parameters
    ----------
    q : Array, shape (..., time, joint)
        Logged positions [rad].
    """
    moved = np.abs(np.diff(q, axis=-2)).reshape(-1, q.shape[-1])
    return np.array([_step(moved[:, j]) for j in range(q.shape[-1])])


def _step(moved: Array) -> float:
    """Return the largest number of which all differences are whole multiples."""
    rounding = 1e-9 * max(float(moved.max(initial=0.0)), 1e-9)
    found = np.sort(moved[moved > rounding])
    if len(found) < MIN_DIFFERENCES:
        return np.nan
    step = float(found[0])
    for divisor in (1, 2, 3, 4, 5):
        refined = _refined(found, step / divisor)
        if np.isfinite(refined):
            return refined
    return np.nan


def _refined(found: Array, step: float) -> float:
    """Return the step that fits differences, the smallest first, from a first guess; NaN if few are its multiples."""
    for most in (5, 50, MAX_STEPS):
        some = found[found < (most + 0.5) * step]
        if most == MAX_STEPS and len(some) < MIN_DIFFERENCES:
            return np.nan
        count = np.round(some / step)
        if (np.abs(some / step - count) > OFF).any():
            return np.nan
        step = float(count @ some / (count @ count))
    return step
