"""The winding of a DC motor, L di/dt = v - R i - e, solved exactly while v and e are constant."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sim.drives.pwm import Modulator, Pattern, Pieces, pieces
from sim.motors import Array


class Winding(NamedTuple):
    """A winding between the legs of an H-bridge.

    Parameters
    ----------
    V, R, L : Array, shape (joint,)
        Bus voltage [V], resistance [ohm], inductance [H].
    """

    V: Array
    R: Array
    L: Array


class Passage(NamedTuple):
    """What happened to a winding during a PWM period."""

    i: Array
    """Current at the end [A]."""

    charge: Array
    """Integral of the current [A s]."""

    electrical: Array
    """Energy that came in at the terminals [J]."""


def pass_period(i: Array, m: Array, e: Array, winding: Winding, modulator: Modulator) -> Passage:
    """Return the passage of a winding through a PWM period.

    Between edges the current goes exponentially to (v - e)/R. While a leg is dead the sign of the current decides v; where the
    current reaches zero it stays, as no diode conducts, unless the back-EMF drives it on.

    Parameters
    ----------
    i, e : Array, shape (sim, joint)
        Current [A] and back-EMF [V].
    m : Array, shape (sim, joint)
        Modulation index.
    winding : Winding
    modulator : Modulator
    """
    forward = (i > 0).astype(np.float64)
    passage, edges = _straight(i, e, winding, modulator.pattern(m, forward), modulator.period)
    turning = (edges * i <= 0).any(axis=0)
    if modulator.dead_time and turning.any():
        some = Winding(*(np.broadcast_to(x, i.shape)[turning] for x in winding))
        careful = _step_by_step(i[turning], e[turning], some, pieces(modulator, m[turning]))
        for whole, part in zip(passage, careful, strict=True):
            whole[turning] = part
    return passage


def _straight(i: Array, e: Array, winding: Winding, pattern: Pattern, period: float) -> tuple[Passage, Array]:
    """Return the passage of a current that keeps its sign, and the current at every edge."""
    V, R, L = winding
    rate, t, now, edges = R / L, 0.0, i, []
    rest = (pattern.base * V - e) / R
    charge, extra = np.zeros_like(i), np.zeros_like(i)  # all of it, and that of the pulses times their voltage
    for pulse in pattern.pulses:
        for goal, until in ((rest, pulse.start), ((pulse.level * V - e) / R, pulse.end)):
            dt = until - t
            after = goal + (now - goal) * np.exp(-rate * dt)
            part = goal * dt + (now - after) / rate
            charge += part
            t, now = until, after
            edges.append(after)
        extra += (pulse.level - pattern.base) * part
    dt = period - t
    after = rest + (now - rest) * np.exp(-rate * dt)
    charge += rest * dt + (now - after) / rate
    return Passage(after, charge, V * (pattern.base * charge + extra)), np.array([*edges, after])


def _step_by_step(i: Array, e: Array, winding: Winding, period: Pieces) -> Passage:
    """Return the passage of a current that may change its sign."""
    V, R, L = winding
    charge, electrical = np.zeros_like(i), np.zeros_like(i)
    for dt, forward, backward in zip(*period, strict=True):
        ahead, behind = (forward * V - e) / R, (backward * V - e) / R
        goal = np.where(i > 0, ahead, behind)
        after = goal + (i - goal) * np.exp(-dt * R / L)
        at_zero = (forward != backward) & (i * after <= 0)
        if at_zero.any():
            until, onward = _at_zero(at_zero, i, goal, ahead, behind, R / L)
            until = np.minimum(until, dt)
            before, rest = np.where(at_zero, until, dt), np.where(at_zero, dt - until, 0.0)
            end = np.where(at_zero, -onward * np.expm1(-rest * R / L), after)
            meeting = np.where(at_zero, 0.0, after)
            second = onward * rest + (meeting - end) * L / R
        else:
            before, end, meeting, second, onward = dt, after, after, 0.0, goal
        first = goal * before + (i - meeting) * L / R
        charge += first + second
        electrical += (goal * R + e) * first + (onward * R + e) * second
        i = end
    return Passage(i, charge, electrical)


def _at_zero(
    at_zero: npt.NDArray[np.bool_], i: Array, goal: Array, ahead: Array, behind: Array, rate: Array
) -> tuple[Array, Array]:
    """Return when the current is zero [s], and where it goes from there: nowhere, unless the back-EMF drives it."""
    crossing = at_zero & (goal != 0) & (i != 0)
    share = np.where(crossing, 1 - i / np.where(crossing, goal, 1.0), 1.0)
    return np.log(share) / rate, np.maximum(ahead, 0.0) + np.minimum(behind, 0.0)
