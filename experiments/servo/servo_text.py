"""Servos as text."""

import ast
import inspect
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from pprint import pformat
from textwrap import dedent, indent
from typing import Any

import numpy as np
from rich.text import Text

from idbench.experiments.errors import ExperimentError
from idbench.experiments.results.page import Page
from idbench.experiments.servo.identification import Servos
from idbench.experiments.text import new_table, number, print_titled
from idbench.identify import Array
from idbench.identify.servo import Servo, ServoFit
from idbench.identify.servo.choice import ServoFrictionChoice, lacks_of
from idbench.identify.servo.parameters import SERVO_PARAMETERS
from idbench.sim.robot.servos import Commands, ServoValues, replay, with_servos

NONE = {"rate": float("inf"), "vs": 1.0}
"""What parameters are that a servo does not have; others are 0."""


def servo_function(robot: str, fits: Mapping[str, tuple[Servo, ServoFit]], logs: Sequence[str]) -> str:
    """Return the file: what is known of each joint's servo, and what was found."""
    text = files("idbench.experiments.exports").joinpath("servo.py.txt").read_text(encoding="utf-8")
    every = {joint: _parameters(servo, fit) for joint, (servo, fit) in fits.items()}
    table = pformat(every, width=110, sort_dicts=False).replace("inf", 'float("inf")')
    words = {
        "{friction}": _friction_lines(),
        "{name}": robot,
        "{version}": version("idbench"),
        "{logs}": ", ".join(logs),
        "{servos}": table,
    }
    for mark, word in words.items():
        text = text.replace(mark, word)
    return text


def _friction_lines() -> str:
    """Return the lines of the compiled friction as plain Python, the parameters `p` a table."""
    from idbench.identify.servo.servo_step import friction

    lines: Any = ast.parse(dedent(inspect.getsource(friction.py_func))).body[0]
    code = re.sub(r"\bp\.(\w+)", r'p["\1"]', "\n".join(ast.unparse(line) for line in lines.body[1:]))
    return indent(code.replace("return ", 'return p["Fo"] * (not on) + '), 8 * " ")


def _parameters(servo: Servo, fit: ServoFit) -> dict[str, float]:
    known = {"gain": servo.gain * servo.kp, "supply": servo.supply, "duty_limit": servo.duty_limit, "counts": servo.counts}
    return {**known, **{name: float(fit.p.get(name, NONE.get(name, 0.0))) for name in SERVO_PARAMETERS if name != "backlash"}}


VAGUE = 0.5
"""Standard error, as a share of the value, from which on a parameter is reported as unidentified."""

ALIKE = 1.5
"""Error on held-out logs, over that on the fitted ones, up to which a model holds."""

EXPLAINED = 3.0
"""Residual over what rounding leaves, up to which there is nothing to explain: clocks of cheap servos jitter."""

UNEXPLAINED = 20
"""Counts of a typical residual from which on something is missing."""

EXPRESSIBLE = ("a", "b", "Ia", "Fs", "Fv", "offset", "delay", "rate", "backlash")
"""Parameters that a file of MuJoCo has, or that its user adds to commands."""

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
    """Return what to check, each thing once for all joints that it concerns."""
    return _grouped((joint, text) for joint, fit in fits.items() if isinstance(fit, ServoFit) for text in _warnings(fit))


def _grouped(said: Iterable[tuple[str, str]]) -> list[str]:
    joints = dict[str, list[str]]()
    for joint, text in said:
        joints.setdefault(text, []).append(joint)
    return [f"{', '.join(of)}: {text}" for text, of in joints.items()]


def _warnings(fit: ServoFit) -> Iterator[str]:
    if spikes := sum(int((~run.read_well).sum()) for run in fit.loop.runs):
        yield f"{spikes} positions are spikes, from which the joint came back at once: they are left out"
    sigma = fit.standard_errors
    if vague := [name for name in RATIOS if name in sigma and sigma[name] > VAGUE * abs(fit.p[name])]:
        yield (
            f"{', '.join(vague)} cannot be told apart: torque, friction and armature scale together where the known load is "
            "small. Move the joint through gravity, or add a known mass to the robot's file"
        )
    if not fit.excitation.off:
        yield "torque is never off, so b is the sum of back-EMF and viscous friction, and Fv is 0"
    if "rate" not in fit.free:
        yield "no command is faster than the rate limit of the firmware, if there is one"
    if fit.scale > UNEXPLAINED * fit.servo.step:
        yield (
            f"residuals of {fit.scale:.2g} rad are {fit.scale / fit.servo.step:.0f} counts: try --friction auto, "
            "--find lead backlash, and check kp, supply and the mass of the load"
        )


def inexpressible(fits: Mapping[str, ServoFit]) -> list[str]:
    """Return what MuJoCo's servos do not have of what was found."""
    lost = dict.fromkeys(x for fit in fits.values() for x in fit.free if x not in EXPRESSIBLE)
    meanings = ", ".join(f"{x} ({SERVO_PARAMETERS[x].meaning})" for x in lost)
    found = [f"MuJoCo's dcmotor cannot express {meanings}: the errors in plain MuJoCo include that"] if lost else []
    if any("backlash" in fit.free for fit in fits.values()):
        found.append("backlash is written as a second joint; the loop of the dcmotor sees the rotor, before the play")
    offsets = {joint: fit.p["offset"] for joint, fit in fits.items()}
    words = ", ".join(f"{joint} {x:+.4g}" for joint, x in offsets.items())
    return [*found, f"the file's angles are the log's plus an offset [rad]: {words}; add it to commands"]


def without_servo(joints: Sequence[str], fits: Mapping[str, ServoFit]) -> list[str]:
    """Return which joints of a written file have no servo."""
    lost = [joint for joint in joints if joint not in fits]
    return [f"{', '.join(lost)}: no servo is written; what the robot's file has there stays"] if lost else []


def verdicts(fits: Mapping[str, ServoFit], fitted: Mapping[str, Array], held_out: Mapping[str, Array]) -> list[str]:
    """Return lines: whether models hold on logs that they did not see, and where their residuals are largest."""
    said = ((joint, _holds(fit, fitted[joint], held_out.get(joint))) for joint, fit in fits.items())
    return [*_grouped(said), *_grouped((joint, _lacks(fit)) for joint, fit in fits.items())]


def _holds(fit: ServoFit, fitted: Array, held_out: Array | None) -> str:
    if held_out is None:
        return "no held-out log says whether the model holds elsewhere (name a second log)"
    floor, ratio = fit.servo.step / 4, float(np.mean(held_out) / np.mean(fitted))
    if ratio <= ALIKE or np.mean(held_out) <= 2 * floor:
        return "the model holds on other logs"
    return f"the model does not hold on other logs: its error there is {ratio:.2g} times that on the fitted ones"


def _lacks(fit: ServoFit) -> str:
    lacks, floor = lacks_of(fit), fit.servo.step / 4  # what rounding leaves, on average
    if lacks[0].error <= EXPLAINED * floor:
        return "its residuals are little more than the rounding of the encoder"
    parts = ", ".join(f"{lack.error / fit.servo.step:.2g} counts while {lack.when}" for lack in lacks)
    return f"mean residuals: {parts}"


def print_choice(page: Page, joint: str, choice: ServoFrictionChoice) -> None:
    """Print laws of friction compared by parts of the log that their fits did not see."""
    first = next(iter(choice.errors))
    grid = new_table("law", ["counts", f"p, against {first}"])
    for law, error in choice.errors.items():
        p = f"{choice.p[law]:.2g}" if law in choice.p else ""
        grid.add_row(f"{law}{' (chosen)' if law == choice.chosen else ''}", number(error / choice.fits[law].servo.step), p)
    print_titled(page, f"{joint}: laws of friction, by the error of parts of the log that their fits did not see", grid)


def values_of(servos: Servos, fit: ServoFit, joint: str) -> ServoValues:
    """Return a servo as MuJoCo has it, with the firmware gain of the file."""
    p, servo = fit.p, servos.known.servo(joint, "")
    known = servo.gain * servo.kp, servo.supply, servo.duty_limit
    rate, play = p.get("rate", np.inf), p.get("backlash", 0.0)
    return ServoValues(p["a"], p["b"], *known, p["Ia"], p["Fv"], p["Fs"], rate, p["delay"], play)


def mjcf_of(servos: Servos, fits: dict[str, ServoFit], folder: Path, position: bool = False) -> str:
    """Return the robot's MJCF with the servos that were found."""
    place = {servos.place(joint): values_of(servos, fit, joint) for joint, fit in fits.items()}
    return with_servos(servos.robot, place, folder, servos.mounting, position)


def in_mujoco(servos: Servos, text: str, folder: Path, fits: dict[str, ServoFit], path: Path) -> dict[str, float]:
    """Return the mean absolute error [rad] of each joint, a log's commands given to the written file in plain MuJoCo."""
    columns, known = servos.logs[path], servos.known
    places = [servos.place(joint) for joint in fits]
    offset = np.zeros(servos.links.n)
    offset[places] = [fit.p["offset"] for fit in fits.values()]
    if any(known.servo(joint, path.name).kp != known.servo(joint, "").kp for joint in fits):
        raise ExperimentError(f"{path.name} has another kp than the file that was written")
    if servos.links_of(path) is not servos.links:
        raise ExperimentError(f"{path.name} is of another robot than the file that was written")
    on = None if columns.on is None else columns.on[:, places] > 0.5
    sent = Commands(columns.t, (columns.command + offset)[:, places], places, on)
    q = replay(servos.robot, text, folder, sent, columns.q[0] + offset)
    error = np.abs(q - columns.q - offset).mean(axis=0)
    return {joint: float(error[j]) for joint, j in zip(fits, places, strict=True)}
