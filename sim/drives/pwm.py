"""Pulse patterns of an H-bridge: what voltage lies at the winding, and when, in a PWM period; and the current it makes."""

from collections.abc import Callable
from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from idbench.sim.robot.motors import Array

Modulation = Literal["unipolar", "bipolar", "sign_magnitude"]


class Pulse(NamedTuple):
    """A stretch of a period in which the voltage is not the base voltage."""

    start: Array
    """Its beginning [s]."""

    end: Array
    """Its end [s]."""

    level: Array
    """Voltage, in bus voltages."""


class Pattern(NamedTuple):
    """A PWM period: a base voltage, in bus voltages, and pulses that follow each other."""

    base: float
    pulses: tuple[Pulse, ...]


class Modulator(NamedTuple):
    """A centre-aligned chopper."""

    modulation: Modulation
    """unipolar: two legs, each with the same carrier and opposite references (phase-shifted, two pulses a period); bipolar: the
    legs switch together, always one up and one down; sign_magnitude: one leg rests at the bus's end."""
    period: float
    """Period of the modulation [s]."""
    dead_time: float
    """Time between a transistor turning off and its partner turning on [s]."""

    def pattern(self, m: Array, forward: Array) -> Pattern:
        """Return the pulses for the modulation index `m`, mean voltage over bus voltage, -1 to 1.

        `forward` is 1 where the current is positive and 0 where it is negative. It decides what a leg does while it is dead,
        both its transistors off: a diode connects it to the low end of the bus while current flows out of it, and to the high
        end while current flows in. A positive current flows out of the first leg and into the second.
        """
        return _PATTERNS[self.modulation](m, self.period, self.dead_time * forward, self.dead_time * (1 - forward))


def _unipolar(m: Array, period: float, late: Array, long: Array) -> Pattern:
    first, second = (1 + m) * (period / 4), (1 - m) * (period / 4)  # half the time for which each leg is up
    up1, up2 = period / 2 - first + late, period / 2 - second + long
    down1, down2 = period / 2 + first + long, period / 2 + second + late
    rising = Pulse(np.minimum(up1, up2), np.maximum(up1, up2), np.sign(up2 - up1))
    falling = Pulse(np.minimum(down1, down2), np.maximum(down1, down2), np.sign(down1 - down2))
    return Pattern(0.0, (rising, falling))


def _bipolar(m: Array, period: float, late: Array, long: Array) -> Pattern:
    half = (1 + m) * (period / 4)
    return Pattern(-1.0, (Pulse(period / 2 - half + late, period / 2 + half + long, np.ones_like(m)),))


def _sign_magnitude(m: Array, period: float, late: Array, long: Array) -> Pattern:
    half, positive = np.abs(m) * (period / 2), m >= 0
    start = period / 2 - half + np.where(positive, late, long)
    end = period / 2 + half + np.where(positive, long, late)
    return Pattern(0.0, (Pulse(np.minimum(start, end), end, np.sign(m)),))


_PATTERNS: dict[Modulation, Callable[[Array, float, Array, Array], Pattern]] = {
    "unipolar": _unipolar,
    "bipolar": _bipolar,
    "sign_magnitude": _sign_magnitude,
}


class Pieces(NamedTuple):
    """A period cut where the voltage changes, for either sign of the current; leading axis: piece."""

    duration: Array
    """[s]."""

    forward: Array
    """Voltage while the current is positive, in bus voltages."""

    backward: Array
    """Voltage while the current is negative: it differs while a leg is dead."""


def pieces(modulator: Modulator, m: Array) -> Pieces:
    """Return the pieces of a period in which the current may change its sign; `m` has the shape (winding,)."""
    both = modulator.pattern(m, np.array([[1.0], [0.0]]))
    edges = np.array([np.broadcast_to(edge, (2, *m.shape)) for pulse in both.pulses for edge in pulse[:2]])
    ends = np.empty((2 * len(edges) + 2, *m.shape))
    ends[0] = 0.0
    ends[1:-1] = np.sort(edges.reshape(-1, *m.shape), axis=0)
    ends[-1] = modulator.period
    middle = ((ends[1:] + ends[:-1]) / 2)[:, None]
    level = np.full((len(middle), 2, *m.shape), both.base)
    for pulse in both.pulses:
        level += (pulse.level - both.base) * ((middle > pulse.start) & (middle < pulse.end))
    return Pieces(ends[1:] - ends[:-1], level[:, 0], level[:, 1])


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
