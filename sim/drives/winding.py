"""The winding of a DC motor, L di/dt = v - R i - e, solved exactly while v and e are constant."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from idbench.sim.drives.pwm import Modulator, Pattern, Pieces, pieces
from idbench.sim.robot.motors import Array


class Winding(NamedTuple):
    """A winding between the legs of an H-bridge."""

    V: Array
    """Bus voltage [V], shape (sim, joint)."""
    R: Array
    """Resistance [ohm], shape (sim, joint)."""
    L: Array
    """Inductance [H], shape (sim, joint)."""


class Passage(NamedTuple):
    """What happened to a winding during a PWM period."""

    i: Array
    """Current at the end [A]."""

    charge: Array
    """Integral of the current [A s]."""


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
    """
    forward = (i > 0).astype(np.float64)
    passage, edges = straight(i, e, winding, modulator.pattern(m, forward), modulator.period)
    turning = (edges * i <= 0).any(axis=0)
    if modulator.dead_time and turning.any():
        some = Winding(*(x[turning] for x in winding))
        careful = step_by_step(i[turning], e[turning], some, pieces(modulator, m[turning]))
        for whole, part in zip(passage, careful, strict=True):
            whole[turning] = part
    return passage


def straight(i: Array, e: Array, winding: Winding, pattern: Pattern, period: float) -> tuple[Passage, Array]:
    """Return the passage of a current that keeps its sign, and the current at every edge."""
    V, R, L = winding
    rate = R / L
    now = i
    edges = []
    t, rest = np.zeros(1), (pattern.base * V - e) / R
    push = np.full(i.shape, pattern.base * period)  # volt-seconds, in bus voltages
    for pulse in pattern.pulses:
        before = rest + (now - rest) * np.exp(rate * (t - pulse.start))
        goal, dt = (pulse.level * V - e) / R, pulse.end - pulse.start
        now = goal + (before - goal) * np.exp(-rate * dt)
        t = pulse.end
        push = push + (pulse.level - pattern.base) * dt
        edges += [before, now]
    after = rest + (now - rest) * np.exp(rate * (t - period))
    return Passage(after, (push * V - e * period - L * (after - i)) / R), np.array([*edges, after])


class WindingStretch(NamedTuple):
    """Current that goes from `start` to `end` in `dt`, exponentially towards `goal`."""

    start: Array
    end: Array
    goal: Array
    dt: Array


def step_by_step(i: Array, e: Array, winding: Winding, period: Pieces) -> Passage:
    """Return the passage of a current that may change its sign; all arrays have the shape (winding,)."""
    start, end, goal, dt = stretches(i, e, winding, period)
    charge = goal * dt + (start - end) * (winding.L / winding.R)
    # In the order of time: empty stretches, which others need, change no bit.
    return Passage(end[-1], np.add.accumulate(charge, axis=0)[-1])


def stretches(i: Array, e: Array, winding: Winding, period: Pieces) -> WindingStretch:
    """Return the parts of a period in which the current is one exponential, shape (stretch, winding) each."""
    V, R, L = winding
    ahead, behind = (period.forward * V - e) / R, (period.backward * V - e) / R
    kept, dead = np.exp(-period.duration * (R / L)), ahead != behind
    some_dead, found = dead.any(axis=1), []
    for k, dt in enumerate(period.duration):
        goal = np.where(i > 0, ahead[k], behind[k]) if some_dead[k] else ahead[k]
        whole = WindingStretch(i, goal + (i - goal) * kept[k], goal, dt)
        at_zero = dead[k] & (i * whole.end <= 0)
        found += _over_zero(at_zero, whole, ahead[k], behind[k], R / L) if at_zero.any() else [whole]
        i = found[-1].end
    return WindingStretch(*(np.array(x) for x in zip(*found, strict=True)))


def _over_zero(
    at_zero: npt.NDArray[np.bool_], whole: WindingStretch, ahead: Array, behind: Array, rate: Array
) -> list[WindingStretch]:
    """Return the stretch up to the instant at which the current is zero and the one after it, empty where it never is.

    At zero the current stays, unless the back-EMF drives it on.
    """
    i, after, goal, dt = whole
    crossing = at_zero & (goal != 0) & (i != 0)
    until = np.log(np.where(crossing, 1 - i / np.where(crossing, goal, 1.0), 1.0)) / rate
    rest = np.where(at_zero, dt - np.minimum(until, dt), 0.0)
    onward = np.maximum(ahead, 0.0) + np.minimum(behind, 0.0)
    meeting = np.where(at_zero, 0.0, after)
    end = np.where(at_zero, -onward * np.expm1(-rest * rate), after)
    return [WindingStretch(i, meeting, goal, dt - rest), WindingStretch(meeting, end, onward, rest)]
