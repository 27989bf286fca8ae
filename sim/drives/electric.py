"""Currents and voltages of a drive."""

from typing import NamedTuple

from idbench.sim.robot.motors import Array


class BetweenEdges(NamedTuple):
    """What a winding does within the periods of its chopper, as solved, all of shape (point, period, joint).

    Points come in threes: beginning, middle and end of a time in which the voltage is constant, and which may be empty.
    """

    t: Array
    """Since the beginning of the period [s]."""

    current: Array
    """[A]."""

    voltage: Array
    """At the winding [V]."""


class Electric(NamedTuple):
    """What a drive does, step by step or in the mean over samples, all of shape (time, joint)."""

    reference: Array
    """Current that was asked for, within its limit [A]."""

    current: Array
    """Mean current of each step [A]."""

    voltage: Array
    """Mean voltage at the winding in each step [V]."""

    duty: Array
    """Modulation index: the mean voltage that was asked for, over the bus voltage."""

    limited: Array
    """1 where current or voltage was at its limit, otherwise 0."""

    emf: Array
    """Back-EMF [V]."""
