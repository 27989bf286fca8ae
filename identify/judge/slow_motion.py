"""Up to which speeds friction is not what it is above them, so that a mask should reach farther."""

from itertools import pairwise

import numpy as np
import scipy

from idbench.identify.arrays import Array
from idbench.identify.estimators.problem import Problem
from idbench.identify.rows.rows import Rows
from idbench.identify.signals.masks.reversal import slow_speed

BANDS = np.array([1.0, 2.0, 3.0, 4.0])
"""Ends of the bands of speeds that are looked at, in multiples of what the mask takes: a fifth of the rms speed at most."""

EXCESS = 1.5
"""Rms of the residual in a band, relative to faster motion, above which the band does more harm than good."""

INDEPENDENT = 0.5
"""Share of the rows that count as independent, as neighbours share noise: with all, ten times too many masks are raised."""

CERTAIN = 1e-3
"""Probability that noise alone makes as much, below which it is believed."""


def slow_motion(problem: Problem, X: Array) -> tuple[Array, Array]:
    """Return up to which speed each joint's mask takes motion, and what it should be multiplied by.

    What the explicit model leaves of a joint's torque in slow motion is compared with what it leaves of fast motion (F test). A
    real joint's friction does not jump where its velocity changes sign; one that slides within hundredths of a turn, or has
    grease to squeeze, follows another law there.

    Parameters
    ----------
    problem : Problem
        The explicit model with a `ReversalMask` whose threshold follows the motion.
    X : Array, shape (p,)
        Its estimate.

    Returns
    -------
    speed : Array, shape (joint,)
        Up to which joints rest or reverse [rad/s, m/s], on average over the logs.
    factor : Array, shape (joint,)
        1 where friction is the same down to that speed; else the end of the fastest band where it is not.
    """
    every = [_seen(part.rows, X) for part in problem.parts]
    speed = np.mean([slow for slow, _, _ in every], axis=0)
    factor = np.ones(len(speed))
    for j in range(len(speed)):
        multiple = np.concatenate([v[j] for _, v, _ in every])
        left = np.concatenate([r[j] for _, _, r in every])
        fast = left[multiple > BANDS[-1]]
        for low, high in pairwise(BANDS):
            if _wrong(left[(multiple > low) & (multiple <= high)], fast):
                factor[j] = high
    return speed, factor


def _seen(part: Rows, X: Array) -> tuple[Array, Array, Array]:
    """Return the speeds of the mask, and of every row the joint's speed in multiples of it and the residual; NaN if masked."""
    signals = part.maps[0].signals
    qd = signals.state.qd
    slow = slow_speed(qd)
    left, valid = part.by_kind(part.Y - part.predicted(X)), part.by_kind(part.valid)
    at = np.clip(np.round(part.by_kind(part.time) * signals.fs).astype(np.intp), 0, qd.shape[-1] - 1)
    return slow, np.where(valid, np.abs(np.take_along_axis(qd, at, axis=-1)) / slow[:, None], np.nan), left


def _wrong(some: Array, fast: Array) -> bool:
    """Return whether the residual of some rows is significantly larger than in fast motion."""
    if len(some) < 2 or len(fast) < 2 * len(BANDS) or not fast.any():
        return False
    ratio = float(np.mean(some**2) / np.mean(fast**2))
    return ratio > EXCESS**2 and float(scipy.stats.f.sf(ratio, INDEPENDENT * len(some), INDEPENDENT * len(fast))) < CERTAIN
