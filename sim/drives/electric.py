"""Currents and voltages of a drive."""

from typing import NamedTuple

from sim.robot.motors import Array


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
