"""Current loops, and the windings behind them, as their PWM periods change them."""

from typing import NamedTuple

from idbench.sim.robot.motors import Array


class Loops(NamedTuple):
    """Sampled PI current loops with feedforward of the back-EMF; arrays of shape (sim, joint)."""

    kp: Array
    """Proportional gain [V/A]."""
    ki: Array
    """Integral gain, times the sampling period [V/A]."""
    most: Array
    """Largest voltage that they ask for [V]."""
    known: float
    """Share of the back-EMF that they feed forward."""


class Windings(NamedTuple):
    """What is remembered of windings from period to period, shape (sim, joint) each; changed in place."""

    i: Array
    """Current [A]."""
    sum: Array
    """Of the loop's integrator [V]."""


class PeriodTable(NamedTuple):
    """What a period does at every value of the modulation index, `least` apart, the first being -`highest`."""

    least: float
    highest: int
    linear: Array
    """Charge and currents at edges while a current keeps its sign: (sign, value, joint) -> (constant, by i, by e) x
    quantity."""
    pieces: Array
    """Duration, voltages ahead and behind [bus voltages], and what is kept of the current, (value, piece, joint, 4)."""
    V: Array
    """Shape (joint,)."""
    R: Array
    L: Array
    has_dead_time: bool
