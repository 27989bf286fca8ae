"""Pulse patterns of an H-bridge: what voltage lies at the winding in every piece of a PWM period."""

from collections.abc import Callable
from typing import Literal, NamedTuple

import numpy as np

from sim.motors import Array

Modulation = Literal["unipolar", "bipolar", "sign_magnitude"]


class Pieces(NamedTuple):
    """A PWM period cut at its edges; leading axis: piece."""

    duration: Array
    """[s], shape (piece, ...)."""

    forward: Array
    """Voltage over the winding while the current is positive, in bus voltages, shape (piece, ...)."""

    backward: Array
    """The same while the current is negative: it differs while a leg is dead and a diode conducts."""


def bridge(m: Array, period: float, dead_time: float, modulation: Modulation) -> Pieces:
    """Return the pieces of one centre-aligned period for the modulation index `m`.

    Parameters
    ----------
    m : Array
        Mean voltage over bus voltage, -1 to 1.
    period, dead_time : float
        [s]. Each transistor turns on `dead_time` after its partner has been turned off.
    modulation : str
        unipolar: two legs, each with the same carrier and opposite references (phase-shifted, two pulses a period);
        bipolar: the legs switch together, always one up and one down; sign_magnitude: one leg rests at the bus's end.
    """
    return _PATTERNS[modulation](m, period, dead_time)


def _unipolar(m: Array, period: float, dead_time: float) -> Pieces:
    edges = np.empty((8, *m.shape))
    _leg((1 + m) / 2, period, dead_time, edges[:4])
    _leg((1 - m) / 2, period, dead_time, edges[4:])
    duration, at = _cut(np.sort(edges, axis=0), period)
    up1, up2 = _up(at, edges[:4]), _up(at, edges[4:])
    # A positive current flows out of the first leg, which gives way to low, and into the second, which gives way to high.
    return Pieces(duration, _difference(up1[0], up2[1]), _difference(up1[1], up2[0]))


def _bipolar(m: Array, period: float, dead_time: float) -> Pieces:
    edges = _leg((1 + m) / 2, period, dead_time, np.empty((4, *m.shape)))
    duration, at = _cut(edges, period)
    narrow, wide = _up(at, edges)  # the second leg is high where the first is low, and dead with it
    return Pieces(duration, _difference(narrow, ~narrow), _difference(wide, ~wide))


def _sign_magnitude(m: Array, period: float, dead_time: float) -> Pieces:
    edges = _leg(np.abs(m), period, dead_time, np.empty((4, *m.shape)))
    duration, at = _cut(edges, period)
    narrow, wide = _up(at, edges)
    positive = m > 0
    return Pieces(duration, np.where(positive, narrow, -1.0 * wide), np.where(positive, wide, -1.0 * narrow))


_PATTERNS: dict[Modulation, Callable[[Array, float, float], Pieces]] = {
    "unipolar": _unipolar,
    "bipolar": _bipolar,
    "sign_magnitude": _sign_magnitude,
}


def _leg(duty: Array, period: float, dead_time: float, edges: Array) -> Array:
    """Write the instants between low, dead, high, dead and low of a leg; one that never rises is never dead."""
    half = duty * (period / 2)
    edges[0], edges[2] = period / 2 - half, period / 2 + half
    edges[1] = np.minimum(edges[0] + dead_time, edges[2])
    edges[3] = edges[2] + dead_time * (duty > 0)
    return edges


def _cut(edges: Array, period: float) -> tuple[Array, Array]:
    """Return durations and middles of the pieces between sorted edges."""
    ends = np.empty((len(edges) + 2, *edges.shape[1:]))
    ends[0], ends[1:-1], ends[-1] = 0.0, edges, period
    return ends[1:] - ends[:-1], (ends[1:] + ends[:-1]) / 2


def _up(at: Array, edges: Array) -> tuple[np.typing.NDArray[np.bool_], np.typing.NDArray[np.bool_]]:
    """Return whether a leg is high at the instants `at`, if being dead counts as low, and if it counts as high."""
    return (at > edges[1]) & (at < edges[2]), (at > edges[0]) & (at < edges[3])


def _difference(first: np.typing.NDArray[np.bool_], second: np.typing.NDArray[np.bool_]) -> Array:
    return np.subtract(first, second, dtype=np.float64)
