"""The parameters of a servo: letters, units, limits, and how far a search steps."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from idbench.identify.errors import SettingError

SERVO_FRICTIONS: dict[str, tuple[str, ...]] = {
    "coulomb": (),
    "stribeck": ("Fst", "vs"),
    "load": ("Fl",),
    "load-stribeck": ("Fl", "Fst", "vs", "Fls"),
    "directional": ("Fle", "Flm", "Fst", "vs"),
    "quadratic": ("Fle", "Flm", "Fst", "vs", "Flq"),
    "gear": ("Fgd", "Fgb", "Fst", "vs"),
}
"""What each law has beside Fs and Fv: M1 to M6 of BAM (arXiv 2410.08650), and friction of the torque that the gear transmits,
other when the motor drives (Fgd) than when it is driven (Fgb)."""

SIMPLER = {"stribeck": "coulomb", "load": "coulomb", "load-stribeck": "load", "directional": "load", "gear": "stribeck"}
SIMPLER |= {"quadratic": "directional"}
"""The law of which each is a further one."""


def start_parameters(law: str, p: Mapping[str, float], speed: float) -> dict[str, float]:
    """Initial parameters of a law, from those of the simpler law and a typical speed [rad/s]."""
    load = p.get("Fl", 0.1)
    first = {"Fst": 0.3 * p["Fs"], "vs": 0.1 * speed, "Fl": 0.05, "Fls": 0.3 * load, "Fle": load, "Flm": load, "Flq": 0.0}
    first |= {"Fgd": 0.1, "Fgb": 0.05}
    return {name: first[name] for name in SERVO_FRICTIONS[law]}


class ServoParameter(NamedTuple):
    """One parameter."""

    unit: str
    """Unit."""
    meaning: str
    """What it is."""
    relative: float = 0.0
    """Step of differences, as a share of its value; 0 for parameters that may be zero."""
    of: str = "1"
    """Scale of the step where it is absolute: torque, angle, time, speed, or 1."""
    share: float = 0.01
    """Step as a share of that scale."""
    low: float = 0.0
    """Smallest value."""
    high: float = float("inf")
    """Largest value."""


class ServoLaw(NamedTuple):
    """Parameters of a servo, by the letters of `SERVO_PARAMETERS`; by default those of other laws do nothing."""

    a: float
    b: float
    Ia: float
    Fs: float
    Fv: float
    offset: float
    delay: float
    rate: float = np.inf
    lag: float = 0.0
    lead: float = 0.0
    dead_band: float = 0.0
    gain_error: float = 0.0
    scale_error: float = 0.0
    zero: float = 0.0
    bias: float = 0.0
    backlash: float = 0.0
    Mg: float = 0.0
    Fo: float = 0.0
    Fst: float = 0.0
    vs: float = 1.0
    Fl: float = 0.0
    Fls: float = 0.0
    Fle: float = 0.0
    Flm: float = 0.0
    Flq: float = 0.0
    Fgd: float = 0.0
    Fgb: float = 0.0


NEGATIVE = float("-inf")

LATEST = 1.0  # Longest delay of a command [s]: what comes later is no response to it

SERVO_PARAMETERS: dict[str, ServoParameter] = {
    "a": ServoParameter("N m/V", "torque per volt, kt/R; of a loop that commands torque or current, per N m or A", 0.03),
    "b": ServoParameter("N m s/rad", "damping by back-EMF, kt^2/R", 0.03),
    "Ia": ServoParameter("kg m^2", "armature: inertia of the rotor behind the gear", 0.04),
    "Fs": ServoParameter("N m", "Coulomb friction", of="torque", share=0.01),
    "Fv": ServoParameter("N m s/rad", "viscous friction", of="torque per speed", share=0.01),
    "offset": ServoParameter("rad", "angle of the file minus angle of the log", of="angle", share=2.0, low=-np.pi, high=np.pi),
    "delay": ServoParameter("s", "delay of the command", of="time", share=0.15, low=-LATEST, high=LATEST),
    "rate": ServoParameter("rad/s", "rate limit of the target", 0.02),
    "lag": ServoParameter("s", "time constant of the command's low-pass", of="time", share=0.15, high=LATEST),
    "lead": ServoParameter("s", "by how much the loop sees its position early", of="time", share=0.15, low=NEGATIVE),
    "dead_band": ServoParameter("rad", "error below which there is no duty", of="angle", share=1.0),
    "backlash": ServoParameter("rad", "free play between rotor and link", of="angle", share=1.0),
    "gain_error": ServoParameter("1", "share by which the gain is larger than stated", share=0.02, low=-0.95),
    "scale_error": ServoParameter("1", "share by which commands are larger than stated", share=0.005, low=-0.95),
    "zero": ServoParameter("rad", "zero of the commands, of positions", of="angle", share=1.0, low=-np.pi, high=np.pi),
    "bias": ServoParameter("N m", "constant torque of the joint", of="torque", low=NEGATIVE),
    "Mg": ServoParameter("N m", "gravity of the link beyond the file's, along the sine", of="torque", low=NEGATIVE),
    "Fo": ServoParameter("N m", "further Coulomb friction while torque is off", of="torque", low=NEGATIVE),
    "Fst": ServoParameter("N m", "Stribeck friction: what friction near standstill has above that of sliding", of="torque"),
    "vs": ServoParameter("rad/s", "Stribeck velocity", 0.1, low=1e-4),
    "Fl": ServoParameter("1", "friction per load", share=0.006),
    "Fls": ServoParameter("1", "friction per load near standstill", share=0.006),
    "Fle": ServoParameter("1", "friction per external torque", share=0.009),
    "Flm": ServoParameter("1", "friction per motor torque", share=0.009),
    "Flq": ServoParameter("1/(N m)", "friction per square of the smaller torque", share=0.009),
    "Fgd": ServoParameter("1", "friction per torque of a gear that drives", share=0.009),
    "Fgb": ServoParameter("1", "friction per torque of a gear that is driven", share=0.009),
}
"""All parameters that a servo may have."""

FURTHER = ("lag", "lead", "dead_band", "backlash", "gain_error", "scale_error", "zero", "bias", "Mg", "Fo")
"""Parameters that are found where that is asked for."""


def parameters_of(friction: str, more: Sequence[str] = ()) -> tuple[str, ...]:
    """Parameters that may be found of a servo with a law of friction, in their order.

    Raises
    ------
    SettingError
        If a name is unknown.
    """
    if friction not in SERVO_FRICTIONS:
        raise SettingError(f"friction {friction!r} is unknown; known: {', '.join(SERVO_FRICTIONS)}")
    known = {"a", "b", "Ia", "Fs", "Fv", "offset", "delay", "rate", *SERVO_FRICTIONS[friction]}
    if wrong := [name for name in more if name not in (*known, *FURTHER)]:
        named = [name for name in SERVO_PARAMETERS if name in (*known, *FURTHER)]
        raise SettingError(f"a servo with friction {friction} has no parameter {wrong[0]!r}; known: {', '.join(named)}")
    return tuple(name for name in SERVO_PARAMETERS if name in (*known, *more))
