"""Mistakes that people make with robots and logs: for each, the torque that a small one leaves unexplained.

A column is the derivative of logged - predicted torque by the size of a mistake, at a fit; each shape of one has its line.
"""

from functools import partial
from typing import NamedTuple

import numpy as np

from idbench.identify.judge import mistake_columns as column
from idbench.identify.judge.mistake_columns import CREEP, LONG, PRESLIDING, Columns, friction, of_every, of_joint, rms, turning

RARE = 3  # Rank of what few robots have: of causes that explain the same, the others are more likely


class Mistake(NamedTuple):
    """A mistake, and what it leaves unexplained."""

    cause: str
    """What is wrong, in a word."""
    columns: Columns
    """Of a joint, or of the robot: a column, or several that belong together."""
    unit: str = "1"
    """Of its size."""
    of: str = "torque"
    """What it is a mistake of: torque, position, friction, drive, base, link or clock."""
    setting: float = 0.0
    """Of cogging: waves a turn; of a length: along which axis."""
    most: float = np.inf
    """Size above which it is not small, and its column says nothing of it; of a length over the largest of the robot."""
    left: float = 1e-4
    """Share of its column's squares that parameters must leave for it to be distinct from them: less is noise of positions."""
    rank: int = 2
    """How seldom it is made, from 0 to `RARE`: of mistakes that explain the same, the more common one is named first."""
    positive: bool = False
    """Whether nothing makes a size below zero, which then is noise of the positions: compliance, play, an inertia, a load."""


GAIN = Mistake("gain", of_joint(lambda m, j: m.torque[j]), most=1.0, left=1e-6, rank=0)  # Torques that are all too large

ECCENTRIC = Mistake("eccentric", column.eccentric, "rad", "position", most=0.5, rank=RARE)  # Of hinges

OF_JOINTS: tuple[Mistake, ...] = (
    GAIN,
    Mistake("offset", of_joint(lambda m, _: np.ones_like(m.t)), "N m", rank=1),
    Mistake("drift", of_joint(lambda m, _: m.t - m.t[0]), "N m/s", rank=RARE),
    Mistake("saturation", of_joint(lambda m, j: -(m.torque[j] ** 3)), "1/(N m)^2", rank=RARE),
    Mistake("dead_band", of_joint(lambda m, j: -np.sign(m.torque[j])), "N m", rank=RARE),
    Mistake("delay", of_joint(lambda m, j: -m.rate(m.torque[j])), "s", rank=1),
    Mistake("delay", column.late_position, "s", "position"),
    Mistake("zero", column.position_zero, "rad", "position", most=0.5),
    Mistake("scale", column.position_scale, "1", "position", most=0.3),
    ECCENTRIC,
    Mistake("rotor", of_joint(lambda m, j: m.state.qdd[j]), "kg m^2", "drive", positive=True, rank=1),
    Mistake("coupled_rotor", column.coupled, "kg m^2", "drive", rank=RARE),
    Mistake("spring", of_joint(lambda m, j: m.state.q[j]), "N m/rad", "drive"),
    Mistake("load", of_joint(lambda m, j: np.abs(m.load[j]) * np.sign(m.state.qd[j])), "1", "friction", positive=True),
    *(Mistake("velocity", of_joint(partial(column.fading, share=share)), "N m", "friction") for share in CREEP),
    Mistake("velocity", of_joint(lambda m, j: m.state.qd[j] * np.abs(m.state.qd[j])), "N m s^2/rad^2", "friction"),
    Mistake("asymmetry", of_joint(lambda m, j: np.abs(m.state.qd[j])), "N m s/rad", "friction"),
    Mistake("warming", of_joint(lambda m, j: (m.t - m.t[0]) * m.state.qd[j]), "N m/rad", "friction"),
    Mistake("warming", of_joint(lambda m, j: (m.t - m.t[0]) * np.sign(m.state.qd[j])), "N m/s", "friction"),
    *(Mistake("hysteresis", of_joint(turning(share)), "N m", "friction", positive=True, rank=RARE) for share in PRESLIDING),
    Mistake("backlash", column.backlash, "rad", "drive", positive=True, rank=RARE),
    Mistake("elasticity", column.elasticity, "rad/(N m)", "drive", positive=True, rank=RARE),
    *(Mistake("length", partial(column.link_length, axis=axis), "m", "link", axis, most=LONG, rank=RARE) for axis in range(3)),
    Mistake("axis", column.link_axis, "rad", "link", most=0.5, rank=RARE),
)
"""Mistakes of a joint."""

TILT = Mistake("tilt", column.tilt, "rad", "base", rank=1)

OF_ROBOT: tuple[Mistake, ...] = (
    TILT,
    Mistake("delay", lambda m, _: column.whole_rows(-m.rate(m.torque)), "s", rank=0),
    Mistake("warming", lambda m, _: column.whole_rows((m.t - m.t[0]) * (m.torque - m.load)), "1/s", "friction"),
    Mistake("load", of_every(lambda m, j: np.abs(m.load[j]) * np.sign(m.state.qd[j])), "1", "friction", positive=True),
    *(Mistake("velocity", of_every(partial(column.fading, share=share), friction), "1", "friction") for share in CREEP),
    Mistake("velocity", of_every(lambda m, j: m.state.qd[j] * np.abs(m.state.qd[j]), column.drag), "1", "friction"),
    Mistake("asymmetry", column.asymmetric, "1", "friction"),
    *(
        Mistake("hysteresis", of_every(turning(share), friction), "1", "friction", positive=True, rank=RARE)
        for share in PRESLIDING
    ),
    Mistake("saturation", of_every(lambda m, j: -(m.torque[j] ** 3), lambda m, j: 1 / rms(m.torque[j]) ** 2), "1", rank=RARE),
    Mistake("rate", lambda m, _: column.whole_rows(m.faster()), "1", "clock", most=0.3),
    Mistake("clock_drift", lambda m, _: column.whole_rows(-(m.t - m.t[0]) * m.rate(m.torque)), "s/s", "clock", rank=RARE),
)
"""Mistakes of the whole robot, or of all torques."""

FROM_AN_INSTANT: tuple[Mistake, ...] = (Mistake("payload", column.payload, "kg", "link"),)
"""Mistakes that are looked for from each of some instants on; the zero of a joint, which is a slip then, is one, too."""

COGGING = Mistake("cogging", column.ripple, "N m", "drive")  # Of `setting` waves a turn, those that residuals have most of
COMMUTATION = Mistake("commutation", column.ripple, "1", "drive", most=0.5)  # The same in the torque constant

COLLISION = Mistake("collision", of_joint(lambda m, _: np.ones_like(m.t)), "N m", rank=RARE)
"""A torque that acts for a moment, where residuals are largest."""

BASE: tuple[Mistake, ...] = tuple(
    Mistake("base_motion", partial(column.pushed, axis=axis), "m/s^2", "base", rank=RARE) for axis in range(3)
)
"""Motion of the base, at the frequencies that residuals have."""
