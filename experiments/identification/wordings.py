"""Every cause in words, and the option that mends it."""

from collections.abc import Mapping
from typing import NamedTuple

FRICTION = "compare laws of friction: --friction auto"
RESIDUAL = "look at its residual over the"
ELSE = "something else, {size} rms,"


class Wording(NamedTuple):
    """How a cause is called, and mended."""

    what: str
    """What is wrong, {size} being how much."""
    mend: str = ""
    """The option that mends it; empty if none does."""
    by: str = ""
    """What else mends it."""
    law: str = ""
    """The law of friction that explains it."""


WORDINGS: Mapping[tuple[str, str], Wording] = {
    ("gain", "torque"): Wording("{of_gain}", "{gains}"),
    ("sign", "torque"): Wording("the torque has the other sign", "{gains}"),
    ("unit", "position"): Wording("positions are in degrees", "--units q=deg"),
    ("unit", "joint"): Wording("its position is in degrees", by="convert its column to the unit of the others"),
    ("unknown", "velocity"): Wording(f"{ELSE} over its velocity", by=FRICTION),
    ("unknown", "load"): Wording(f"{ELSE} over its load", by=FRICTION),
    ("unknown", "position"): Wording(
        f"{ELSE} over its position", by=f"{RESIDUAL} position: a spring, a cable, a wave of its gear"
    ),
    ("unknown", "acceleration"): Wording(f"{ELSE} over its acceleration", by=f"{RESIDUAL} acceleration: a rotor, a delay"),
    ("unknown", "other joints"): Wording(
        f"{ELSE} over the motion of other joints", by="are torques mixed, as by a belt or a differential?"
    ),
    ("unknown", "moment"): Wording(f"{ELSE} for a moment of the log", by=f"{RESIDUAL} time, and cut that out"),
    ("stated", "request"): Wording("{stated} contradicts the log", by="leave {stated} out, or correct it"),
    ("sign", "joint"): Wording(
        "position and torque have the other sign: its axis points the other way",
        by="turn the axis in the robot's file, or both signs in the log",
    ),
    ("sign", "position"): Wording(
        "the position has the other sign", by="turn the axis in the robot's file, or the sign in the log"
    ),
    ("offset", "torque"): Wording("torque offset of {size}", "--add offset"),
    ("drift", "torque"): Wording("the torque drifts by {size}", by="warm the sensor up, or take a shorter log"),
    ("saturation", "torque"): Wording(
        "torque constant that falls with the torque, or a limit", by="move more slowly, or with lighter loads"
    ),
    ("dead_band", "torque"): Wording("dead band of the torque, {size}", by="calibrate it"),
    ("delay", "torque"): Wording("torque acts {late} than the log says, by {size}, or lags", "--torque-delay {delay}"),
    ("delay", "position"): Wording("position is logged {size} {behind}, or lags", by="correct the delay of its position"),
    ("zero", "position"): Wording(
        "zero of the position off by {size}", by="subtract it from the joint's positions, or turn the link's frame in the file"
    ),
    ("scale", "position"): Wording("positions {size} too {large}", by="correct the scale of the encoder, or its unit"),
    ("slip", "position"): Wording("position slips by {size} at {instant}", by="take the log up to there, or mend the encoder"),
    ("eccentric", "position"): Wording(
        "eccentric encoder, {size}", by="mount the encoder anew, or correct its errors by a table"
    ),
    ("rotor", "drive"): Wording("rotor inertia of {size} is missing", "--armature all"),
    ("coupled_rotor", "drive"): Wording("its rotor also turns with the next joint, {size}", "--coupling {coupling}"),
    ("spring", "drive"): Wording(
        "a spring of {size}", by="state stiffness and springref of the joint in the robot's file, or --balancer"
    ),
    ("load", "friction"): Wording("friction grows with the load, by {size}", "--friction {laws}", law="load"),
    ("velocity", "friction"): Wording("friction is nonlinear in velocity", "--friction {laws}", law="stribeck"),
    ("asymmetry", "friction"): Wording("friction differs by direction", "--friction {laws}", law="asymmetric-viscous"),
    ("warming", "friction"): Wording(
        "friction changes with time, as of a robot that warms up", by="log a warm robot, or its temperature"
    ),
    ("hysteresis", "friction"): Wording(
        "friction with hysteresis after reversals (pre-sliding)", by="take a larger --mask-speed, or longer strokes"
    ),
    ("cogging", "drive"): Wording(
        "cogging of {setting:g} waves a turn, {size}", "--friction {laws}{cutoff}", law="cogging:{setting:g}"
    ),
    ("commutation", "drive"): Wording(
        "torque constant with a ripple of {setting:g} waves a turn, {size}", by="correct currents by a table over the position"
    ),
    ("backlash", "drive"): Wording("play of {size}", by="measure positions at the link"),
    ("elasticity", "drive"): Wording("compliance of {size}", by="measure positions at the link, or move more slowly"),
    ("length", "link"): Wording("origin of the joint off by {size} along {axis}", by="correct its origin in the robot's file"),
    ("axis", "link"): Wording("axis turned by {size}", by="correct its axis in the robot's file"),
    ("payload", "link"): Wording("a payload from {instant} on", by="take the log up to there, or idbench payload"),
    ("collision", "torque"): Wording("a push of {size} at {instant}", by="cut it out of the log"),
    ("tilt", "base"): Wording("the base is tilted by {size}", "--gravity {gravity}"),
    ("gravity", "base"): Wording("gravity points elsewhere, or is not in the torques", "--gravity {gravity}"),
    ("base_motion", "base"): Wording("the base moves, {size}", by="take a stiffer stand, or move more slowly"),
    ("rate", "clock"): Wording("the motion is {size} {faster} than t says", by="correct the unit of t, or fs"),
    ("clock_drift", "clock"): Wording(
        "clocks of positions and torques drift apart by {size}", by="log with one clock, or take a shorter log"
    ),
    ("exchanged", "torque"): Wording(
        "its torque is exchanged with that of {other}", by="exchange the columns of its torque and that of {other}"
    ),
    ("exchanged", "position"): Wording(
        "its position is exchanged with that of {other}", by="exchange the columns of its position and that of {other}"
    ),
    ("exchanged", "joint"): Wording(
        "its columns are exchanged with those of {other}",
        by="exchange their names in the header; where columns are numbered, --joints {joints}",
    ),
    ("dropouts", "log"): Wording(
        "samples were dropped, held or repeated: {size}, the first at {instant}",
        by="log without dropouts, or identify a part that has none",
    ),
    ("missing_torque", "torque"): Wording(
        "its torque does not follow the motion: it was not logged, and its rows are left out", by="log it"
    ),
}
"""Every cause of the table of mistakes, and what it is a mistake of."""
