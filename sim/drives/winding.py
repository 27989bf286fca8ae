"""The winding of a DC motor, L di/dt = v - R i - e, solved exactly while v and e are constant."""

from typing import NamedTuple

import numpy as np

from sim.drives.pwm import Pieces
from sim.motors import Array


class Passage(NamedTuple):
    """What happened to a winding during a PWM period."""

    i: Array
    """Current at the end [A], shape (...)."""

    charge: Array
    """Integral of the current [A s], shape (...)."""

    electrical: Array
    """Energy that came in at the terminals [J], shape (...)."""

    copper: Array
    """Energy that became heat, R int i^2 dt [J], shape (...)."""

    lowest: Array
    """Least current [A], shape (...)."""

    highest: Array
    """Largest current [A], shape (...)."""


class _Stretches(NamedTuple):
    """Current that goes from `start` to `end` in `dt`, exponentially towards `goal`; leading axis: stretch."""

    start: Array
    end: Array
    goal: Array
    dt: Array


def pass_period(i: Array, pieces: Pieces, V: Array, e: Array, R: Array, L: Array) -> Passage:
    """Return the passage of a winding with the current `i` [A] through the pieces of a PWM period.

    Between edges the current goes exponentially to (v - e)/R. While a leg is dead the sign of the current decides v; where the
    current reaches zero it stays, as no diode conducts, unless the back-EMF drives it on.

    Parameters
    ----------
    i, e : Array, shape (sim, joint)
        Current [A] and back-EMF [V].
    pieces : Pieces
        Durations and voltages.
    V, R, L : Array, shape (joint,)
        Bus voltage [V], resistance [ohm], inductance [H].
    """
    gone = -np.expm1(-pieces.duration * (R / L))
    ahead, behind = (pieces.forward * V - e) / R, (pieces.backward * V - e) / R
    goal = np.where(i > 0, ahead, behind)
    kept, gain = 1 - gone, goal * gone
    edges = np.empty((len(gain) + 1, *i.shape))
    edges[0] = i
    for k in range(len(gain)):
        np.multiply(edges[k], kept[k], out=edges[k + 1])
        edges[k + 1] += gain[k]
    passage = _booked(_Stretches(edges[:-1], edges[1:], goal, pieces.duration), R, L, e)
    doubtful = ((pieces.forward != pieces.backward) & ((edges[:-1] * i <= 0) | (edges[1:] * i <= 0))).any(axis=0)
    if doubtful.any():
        wide_R, wide_L = np.broadcast_to(R, i.shape)[doubtful], np.broadcast_to(L, i.shape)[doubtful]
        parts = i[doubtful], ahead[:, doubtful], behind[:, doubtful], kept[:, doubtful], pieces.duration[:, doubtful]
        careful = _booked(_step_by_step(*parts, wide_R / wide_L), wide_R, wide_L, e[doubtful])
        for whole, part in zip(passage, careful, strict=True):
            whole[doubtful] = part
    return passage


def _step_by_step(i: Array, ahead: Array, behind: Array, kept: Array, duration: Array, rate: Array) -> _Stretches:
    """Return the stretches of windings whose current changes sign in the period; two a piece, the second after a zero."""
    found = []
    for k, dt in enumerate(duration):
        a = np.where(i > 0, ahead[k], behind[k])
        after = i * kept[k] + a * (1 - kept[k])
        at_zero = (ahead[k] != behind[k]) & (i * after <= 0)
        crossing = at_zero & (a != 0)
        until = np.where(crossing, np.log(np.where(crossing, 1 - i / np.where(crossing, a, 1.0), 1.0)) / rate, 0.0)
        onward = np.where(at_zero, np.maximum(ahead[k], 0.0) + np.minimum(behind[k], 0.0), a)
        rest = np.where(at_zero, dt - until, 0.0)
        end = np.where(at_zero, -onward * np.expm1(-rest * rate), after)
        meeting = np.where(at_zero, 0.0, after)
        found += [(i, meeting, a, np.where(at_zero, until, dt)), (meeting, end, onward, rest)]
        i = end
    return _Stretches(*(np.array(x) for x in zip(*found, strict=True)))


def _booked(stretches: _Stretches, R: Array, L: Array, e: Array) -> Passage:
    """Add up charge and energies."""
    start, end, goal, dt = stretches
    tau, fallen = L / R, start - end
    charge = goal * dt + fallen * tau
    squares = goal * charge + (start + end) * (tau / 2) * fallen
    voltage = goal * R + e
    return Passage(
        end[-1].copy(),
        _total(charge),
        _total(voltage * charge),
        R * _total(squares),
        np.minimum(start.min(axis=0), end[-1]),
        np.maximum(start.max(axis=0), end[-1]),
    )


def _total(parts: Array) -> Array:
    """Return the sum over stretches in their order, whatever the number of simulations."""
    total: Array = np.add.accumulate(parts, axis=0)[-1]
    return total
