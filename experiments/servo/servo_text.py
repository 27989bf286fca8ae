"""Servos as text."""

from collections.abc import Mapping

import numpy as np
from rich.text import Text

from experiments.cli.page import Page
from experiments.text import new_table, number, print_titled
from identify import Array
from identify.servo import ServoFit
from identify.servo.parameters import SERVO_PARAMETERS

VAGUE = 0.5
"""Standard error, as a share of the value, from which on a parameter is reported as unidentified."""

RATIOS = ("a", "b", "Ia", "Fs", "Fst")
"""Parameters that only a known load tells apart."""


def print_servos(page: Page, fits: Mapping[str, ServoFit | str]) -> None:
    """Print parameters with their standard errors, and why some joints have none."""
    found = {joint: fit for joint, fit in fits.items() if isinstance(fit, ServoFit)}
    grid = new_table("", [f"{joint}\n{what}" for joint in found for what in ("", "sigma")])
    for name, parameter in SERVO_PARAMETERS.items():
        if any(name in fit.p for fit in found.values()):
            cells = (cell for fit in found.values() for cell in _cells(fit, name))
            grid.add_row(f"{name} [{parameter.unit}]", *cells)
    print_titled(page, "servos: torque = a V duty - b qd, friction and armature at the joint", grid)
    for joint, fit in fits.items():
        if isinstance(fit, str):
            page.print(Text(f"{joint}: no estimate: {fit}"), soft_wrap=True)


def _cells(fit: ServoFit, name: str) -> tuple[str, str]:
    if name not in fit.p:
        return "", ""
    sigma = fit.standard_errors.get(name)
    return number(fit.p[name]), "held" if sigma is None else f"{sigma:.2g}"


def print_errors(page: Page, what: str, errors: Mapping[str, Array]) -> None:
    """Print mean absolute errors of positions that follow from commands alone."""
    for joint, each in errors.items():
        mean = float(np.mean(each))
        page.print(
            Text(f"{what}, {joint}: mean error of the position {mean:.2g} rad ({np.rad2deg(mean):.2g} deg)"), soft_wrap=True
        )


def warnings_of(fits: Mapping[str, ServoFit | str]) -> list[str]:
    """Return what to check."""
    found = list[str]()
    for joint, fit in fits.items():
        if isinstance(fit, str):
            continue
        sigma = fit.standard_errors
        vague = [name for name in RATIOS if name in sigma and sigma[name] > VAGUE * abs(fit.p[name])]
        if vague:
            found.append(
                f"{joint}: {', '.join(vague)} cannot be told apart: torque, friction and armature scale together where the "
                "known load is small. Move the joint through gravity, or add a known mass to the robot's file"
            )
        if not fit.excitation.off:
            found.append(f"{joint}: torque is never off, so b is the sum of back-EMF and viscous friction, and Fv is 0")
        if "rate" not in fit.free:
            found.append(f"{joint}: no command is faster than the rate limit of the firmware, if there is one")
        if fit.scale > 20 * fit.servo.step:
            found.append(
                f"{joint}: residuals of {fit.scale:.2g} rad are {fit.scale / fit.servo.step:.0f} counts of the encoder: try "
                "another --friction, --find lead dead_band, and check kp, supply and the mass of the load"
            )
    return found


def inexpressible(fits: Mapping[str, ServoFit]) -> list[str]:
    """Return what MuJoCo's servos do not have of what was found."""
    lost = {"Fst": "Stribeck friction", "Fl": "friction with load", "Fle": "friction with load", "Fgd": "friction of the gear"}
    lost |= {"lead": "lead", "dead_band": "dead band", "backlash": "backlash", "Fo": "friction while torque is off"}
    kinds = dict.fromkeys(word for fit in fits.values() for name, word in lost.items() if name in fit.free)
    found = [f"MuJoCo's dcmotor cannot express {', '.join(kinds)}: the errors above include that"] if kinds else []
    offsets = {joint: fit.p["offset"] for joint, fit in fits.items()}
    words = ", ".join(f"{joint} {x:+.4g}" for joint, x in offsets.items())
    return [*found, f"the file's angles are the log's plus an offset [rad]: {words}; add it to commands"]
