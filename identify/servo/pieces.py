"""Runs cut where the joint rests: short pieces are simulated together, and nothing is thrown far from what was measured."""

from dataclasses import replace

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.servo.load import JointLoad
from idbench.identify.servo.run import MIN_SAMPLES, ServoRun

REST = 0.1
"""How long joint and command have stood still where a run is cut [s], beside the delay of the command."""

AFTER = 0.05
"""How long they go on to do so [s]: a piece that begins with a motion needs its speed, and the instant when it began."""

SHORTEST = 0.8
"""Least length of a piece [s]."""

MOVES = 4
"""Counts by which a joint moves in a piece that says anything."""


def pieces(run: ServoRun, step: float, delay: float) -> list[ServoRun]:
    """Return a run in pieces that begin at rest, the target of the firmware where the command is.

    Parameters
    ----------
    run : ServoRun
        What was logged.
    step : float
        Of the encoder [rad]; a position that flickers by one still rests.
    delay : float
        By which commands may be late [s].
    """
    rest = REST + delay
    t, first = run.t, np.searchsorted(run.t, run.t - rest)
    last = np.searchsorted(run.t, run.t + AFTER, side="right")
    still = np.array([_rests(run, slice(i, k), step) for i, k in zip(first, last, strict=True)])
    still &= (t >= t[0] + rest) & (t <= t[-1] - AFTER)
    rests = np.flatnonzero(still)
    first_rest = int(rests[0]) if len(rests) else 0
    cuts = [first_rest if _may_begin(run, first_rest, step) else 0]
    for k in rests:
        if t[k] - t[cuts[-1]] >= SHORTEST and k - cuts[-1] >= MIN_SAMPLES:
            cuts.append(int(k))
    if len(cuts) > 1 and (t[-1] - t[cuts[-1]] < SHORTEST or len(t) - cuts[-1] < MIN_SAMPLES):
        cuts.pop()
    parts = [_part(run, slice(a, b)) for a, b in zip(cuts, [*cuts[1:], len(t)], strict=True)]
    moving = [part for part in parts if np.ptp(part.clean) > MOVES * step]
    return moving or parts[:1]


def _may_begin(run: ServoRun, k: int, step: float) -> bool:
    """Return whether a motion before sample k, of which nobody knows how it began, is short, and others follow."""
    t = run.t
    long = len(t) - k >= MIN_SAMPLES and t[-1] - t[k] >= SHORTEST
    return bool(t[k] - t[0] < SHORTEST and long and run.enabled[:k].all() and np.ptp(run.clean[k:]) > MOVES * step)


def _rests(run: ServoRun, some: slice, step: float) -> bool:
    on = run.enabled[some]
    steady = np.ptp(run.command[some]) == 0 and on.all() == on.any()
    return bool(steady and np.ptp(run.clean[some]) <= 1.5 * step)


def _part(run: ServoRun, some: slice) -> ServoRun:
    load = JointLoad(*(_of(x, some) for x in (run.load.inertia, run.load.sine, run.load.cosine, run.load.rest)))
    voltage = None if run.voltage is None else run.voltage[some]
    return replace(
        run, t=run.t[some], q=run.q[some], command=run.command[some], on=run.enabled[some], voltage=voltage, load=load
    )


def _of(x: Array, some: slice) -> Array:
    return x[some] if x.ndim else x
