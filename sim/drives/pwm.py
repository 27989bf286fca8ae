"""Pulse patterns of an H-bridge: what voltage lies at the winding, and when, in a PWM period."""

from collections.abc import Callable
from typing import Literal, NamedTuple

import numpy as np

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
