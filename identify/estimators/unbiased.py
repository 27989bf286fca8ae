"""Rows without the bias that noise of the positions gives W."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from identify.arrays import Array
from identify.data.motion_log import MotionLog
from identify.rows.linearization import smoothed
from identify.rows.rows import Rows
from identify.signals.signals import Signals

PAIRS = 2
"""Pairs of noises that are tried: what one leaves of chance is far below the noise itself, as only its squares count."""

SURE = 4.0
"""Speed over the noise of the velocity at which a joint is certain to move the way it seems to."""


def unbiased(rows: Rows, level: Array, rebuilt: Callable[[MotionLog, Signals], Rows]) -> Rows:
    """Return the rows of one log with W less what noise of the positions adds to it on average.

    Columns hold squares of velocities and sines of positions, so that noise does not average out of them. More noise n of the
    same size, put in with either sign, shows how much: W(q + n) + W(q - n) - 2 W(q) holds the squares alone, and its half is,
    on average, what the log's own noise has added. Every run meets the same n. Joints that hardly move get none: an encoder
    that stands has no noise, and |qd|, of Coulomb friction, no square.

    Parameters
    ----------
    rows : Rows
        Of one log.
    level : Array, shape (..., joint)
        Standard deviation of the positions' noise [rad].
    rebuilt : callable
        Returns the rows of another log with the mask of given signals.
    """
    signals = rows.maps[0].signals
    log, rng, bias = signals.log, np.random.default_rng(0), np.zeros_like(rows.W)
    moves = np.abs(smoothed(signals.state.qd, log.fs)) > SURE * signals.gain * level[..., None]
    size = np.swapaxes(moves * level[..., None], -1, -2)
    for _ in range(PAIRS):
        noise = size * rng.standard_normal(log.q.shape[-2:])
        for sign in (1.0, -1.0):
            bias += rebuilt(replace(log, q=log.q + sign * noise), signals).W - rows.W
    return replace(rows, W=rows.W - bias / (2 * PAIRS))
