"""Identified servos as a Python file, for those who step themselves."""

from collections.abc import Mapping, Sequence
from importlib.metadata import version
from importlib.resources import files
from pprint import pformat

from idbench.identify.servo import Servo, ServoFit
from idbench.identify.servo.parameters import SERVO_PARAMETERS

NONE = {"rate": float("inf"), "vs": 1.0}
"""What parameters are that a servo does not have; others are 0."""


def servo_function(robot: str, fits: Mapping[str, tuple[Servo, ServoFit]], logs: Sequence[str]) -> str:
    """Return the file: what is known of each joint's servo, and what was found."""
    text = files("idbench.experiments.exports").joinpath("servo.py.txt").read_text(encoding="utf-8")
    every = {joint: _parameters(servo, fit) for joint, (servo, fit) in fits.items()}
    table = pformat(every, width=110, sort_dicts=False).replace("inf", 'float("inf")')
    words = {"{name}": robot, "{version}": version("idbench"), "{logs}": ", ".join(logs), "{servos}": table}
    for mark, word in words.items():
        text = text.replace(mark, word)
    return text


def _parameters(servo: Servo, fit: ServoFit) -> dict[str, float]:
    known = {"gain": servo.gain * servo.kp, "supply": servo.supply, "duty_limit": servo.duty_limit, "counts": servo.counts}
    return {**known, **{name: float(fit.p.get(name, NONE.get(name, 0.0))) for name in SERVO_PARAMETERS if name != "backlash"}}
