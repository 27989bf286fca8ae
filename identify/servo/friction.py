"""Friction of servos: six published laws, and one of the gear (`idbench.identify.servo.servo_step` has their formulas)."""

from collections.abc import Mapping

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


def simpler(law: str) -> list[str]:
    """Return the laws that a law extends, the simplest first.

    Examples
    --------
    >>> from idbench.identify.servo.friction import simpler
    >>> simpler("load-stribeck")
    ['coulomb', 'load']
    """
    inner = SIMPLER.get(law)
    return [] if inner is None else [*simpler(inner), inner]


def first_of(law: str, p: Mapping[str, float], speed: float) -> dict[str, float]:
    """Return where the parameters of a law begin, with those of the simpler law and a typical speed [rad/s]."""
    load = p.get("Fl", 0.1)
    first = {"Fst": 0.3 * p["Fs"], "vs": 0.1 * speed, "Fl": 0.05, "Fls": 0.3 * load, "Fle": load, "Flm": load, "Flq": 0.0}
    first |= {"Fgd": 0.1, "Fgb": 0.05}
    return {name: first[name] for name in SERVO_FRICTIONS[law]}
