"""Rows without the bias that noise of the positions gives W."""

from dataclasses import replace

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.noise.linearization import smoothed
from idbench.identify.rows.rows import Rows
from idbench.identify.signals.signals import Signals

SURE = 4.0
"""Speed over the noise of the velocity at which a joint is certain to move the way it seems to."""


def unbiased(rows: Rows, noisier: Rows) -> Rows:
    """Return the rows of one log with W less what noise of the positions adds to it on average.

    Columns hold squares of velocities and sines of positions, so that noise does not average out of them. More noise n of the
    same size, put in with either sign, shows how much: W(q + n) + W(q - n) - 2 W(q) holds the squares alone, and its half is,
    on average, what the log's own noise has added. (One noise is enough: only its squares are left to chance.)

    Parameters
    ----------
    rows : Rows
        Of one log.
    noisier : Rows
        Those of `with_more_noise`.
    """
    return replace(rows, W=2 * rows.W - np.mean(noisier.W, axis=0))


def with_more_noise(signals: Signals, level: Array) -> Signals:
    """Return the signals of two logs, with more noise in the positions, put in with either sign, and with the same mask.

    Every run meets the same noise; which joint gets which part of it depends on how far it moves, not on the order of joints.
    Joints that hardly move get none: their encoder's error is constant, and |qd|, of Coulomb friction, has no square.

    Parameters
    ----------
    signals : Signals
        Of one log.
    level : Array, shape (..., joint)
        Standard deviation of the positions' noise [rad].
    """
    log, rng = signals.log, np.random.default_rng(0)
    moves = np.abs(smoothed(signals.state.qd, log.fs)) > SURE * signals.gain * level[..., None]
    drawn = np.broadcast_to(rng.standard_normal(log.q.shape[-2:]), log.q.shape)
    far = np.argsort(np.argsort(np.std(log.q, axis=-2, keepdims=True)))
    noise = np.swapaxes(moves * level[..., None], -1, -2) * np.take_along_axis(drawn, far, axis=-1)
    q = np.stack([log.q + noise, log.q - noise])
    return replace(signals, log=replace(log, q=q, tau=np.broadcast_to(log.tau, q.shape)), weights_of=signals)
