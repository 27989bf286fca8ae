"""Servos as files: a function in Python, and the robot's MJCF, measured in plain MuJoCo; servos that ship as devices."""

import json
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from pprint import pformat
from typing import Any

import numpy as np

from idbench.experiments.errors import ExperimentError
from idbench.experiments.exports.code import template
from idbench.experiments.servo.bam import device_of_bam
from idbench.experiments.servo.identification import Servos
from idbench.identify.files.servo_file import ServoFile
from idbench.identify.plugins import did_you_mean
from idbench.identify.servo import SERVO_FRICTIONS, Servo, ServoFit
from idbench.identify.servo.identification import with_friction
from idbench.identify.servo.parameters import SERVO_PARAMETERS, ServoLaw
from idbench.sim.robot.servos import Commands, ServoValues, replay, with_servos


def servo_function(robot: str, fits: Mapping[str, tuple[Servo, ServoFit]], logs: Sequence[str]) -> str:
    """Python file of what is known of each joint's servo, and what was found."""
    every = dict[str, dict[str, float]]()
    for joint, (servo, fit) in fits.items():
        known = {name: getattr(servo, name) for name in ("kd", "supply", "limit", "counts", "speed_limit")}
        law = {name: float(x) for name, x in ServoLaw(**fit.p)._asdict().items()}
        every[joint] = {"gain": servo.slope, **known, **{name: law[name] for name in SERVO_PARAMETERS if name != "backlash"}}
    table = pformat(every, width=110, sort_dicts=False).replace("inf", 'float("inf")')
    words = {"name": robot, "version": version("idbench"), "logs": ", ".join(logs)}
    return template("servo.py").substitute(words, servos=table)


EXPRESSIBLE = ("a", "b", "Ia", "Fs", "Fv", "offset", "lag", "lead", "delay", "rate", "backlash", "gain_error")
"""Parameters that a file of MuJoCo has, or that its user adds to commands."""


def cannot_express(letters: Iterable[str], motor: bool = True) -> list[str]:
    """Parameters that a file of MuJoCo has no place for; that of a DC motor has none for a constant torque."""
    lost = dict.fromkeys(x for x in letters if x not in EXPRESSIBLE and (motor or x != "bias"))
    meanings = ", ".join(f"{x} ({SERVO_PARAMETERS[x].meaning})" for x in lost)
    return [f"MuJoCo's dcmotor cannot express {meanings}: what is simulated with the file lacks that"] if lost else []


def inexpressible(fits: Mapping[str, ServoFit], identified: Mapping[str, ServoFit]) -> list[str]:
    """Effects of what was identified that MuJoCo's servos lack, of those that are written."""
    motor = any(fit.servo.kind == Servo.kind for fit in fits.values())
    found = cannot_express((x for fit in fits.values() for x in fit.p if fit.p[x]), motor)
    if any("backlash" in fit.free for fit in fits.values()):
        found.append("backlash is written as a second joint; the loop of the dcmotor sees the rotor, before the play")
    if any(run.forward is not None for fit in fits.values() for run in fit.loop.runs):
        found.append("commanded velocities and torques have no place in the file: it is judged without them")
    words = ", ".join(f"{joint} {fit.offset:+.4g}" for joint, fit in fits.items())
    found.append(f"the file's angles are the log's plus an offset [rad]: {words}; add it to commands")
    if unknown := [joint for joint, fit in identified.items() if "offset" in fit.unscaled]:
        found.append(f"{', '.join(unknown)}: torques have no scale, so the offset is not known")
    return found


def values_of(parameters: Mapping[str, float], servo: Servo) -> ServoValues:
    """A servo as MuJoCo has it: its parameters by their letters, and what is stated of it."""
    p = ServoLaw(**{"offset": 0.0, **parameters})
    slope = servo.slope * (1 + p.gain_error)
    delay = p.delay - servo.steps.early  # of a simulation, which acts early as well
    drive = p.a, p.b, slope, servo.supply, servo.limit, p.Ia, p.Fv, p.Fs, p.rate, delay, p.backlash
    return ServoValues(*drive, servo.kd + slope * p.lead, p.lag, servo.kind == Servo.kind, p.bias)


def for_mujoco(fits: Mapping[str, ServoFit]) -> dict[str, ServoFit]:
    """Fits with the friction that MuJoCo has, which does not grow with the load: fitted again where it did."""
    return {joint: with_friction(fit, "coulomb") if SERVO_FRICTIONS[fit.friction] else fit for joint, fit in fits.items()}


def mjcf_of(servos: Servos, fits: Mapping[str, ServoFit], folder: Path, position: bool = False, log: str = "") -> str:
    """Robot's MJCF with the servos that were found; of a log its robot, and what is stated of its servos."""
    place = {servos.place(joint): values_of(fit.p, servos.known.servo(joint, log)) for joint, fit in fits.items()}
    return with_servos(servos.known.robot(log) or servos.robot, place, folder, servos.mounting, position)


def in_mujoco(
    servos: Servos, fits: Mapping[str, ServoFit], folder: Path, path: Path, position: bool = False
) -> dict[str, float]:
    """Mean absolute error [rad] of each joint, a log's commands given to the file in plain MuJoCo."""
    columns = servos.logs[path]
    places = [servos.place(joint) for joint in fits]
    offset = np.zeros(servos.links.n)
    offset[places] = [fit.offset for fit in fits.values()]
    on = None if columns.on is None else columns.on[:, places] > 0.5
    sent = Commands(columns.t, (columns.command + offset)[:, places], places, on)
    text = mjcf_of(servos, fits, folder, position, path.name)
    q = replay(servos.known.robot(path.name) or servos.robot, text, folder, sent, columns.q[0] + offset)
    error = np.abs(q - columns.q - offset).mean(axis=0)
    return {joint: float(error[j]) for joint, j in zip(fits, places, strict=True)}


BENCH = "pendulum"  # Robot to whose joint a servo is written where none is named


@cache
def devices() -> dict[str, dict[str, Any]]:
    """Devices that ship, by their names."""
    folder = files("idbench.experiments.servo").joinpath("devices")
    found = [json.loads(path.read_text(encoding="utf-8")) for path in folder.iterdir() if path.name.endswith(".json")]
    return {device["name"]: device for device in sorted(found, key=lambda device: str(device["name"]))}


def device_of(name: str) -> dict[str, Any]:
    """A device, or that of a file of BAM; raise ExperimentError if there is none."""
    every = devices()
    if name.endswith(".json"):
        return device_of_bam(Path(name))
    if name not in every:
        raise ExperimentError(f"there is no device {name!r}{did_you_mean(name, every)}; there are {', '.join(every)}")
    return every[name]


def servo_toml_of(device: Mapping[str, Any], kp: float) -> str:
    """A servo.toml of a device, and the words that hold its parameters in a fit."""
    known = "\n".join(f"{key} = {json.dumps(x)}" for key, x in device["known"].items())
    held = " ".join(f"{letter}={of['value']:.4g}" for letter, of in device["parameters"].items() if letter in ("a", "b"))
    above = f"# {device['name']}: {device['source']}\n# a joint without a known load: --hold {held}"
    return f"{above}\n{known}\nkp = {kp:g}  # yours\n"


def mjcf_of_device(device: Mapping[str, Any], robot: str, joints: Sequence[int], kp: float, folder: Path) -> str:
    """A robot's MJCF with the device at joints, by their numbers, and a gain of its firmware."""
    p = {letter: of["value"] for letter, of in device["parameters"].items()}
    values = values_of(p, ServoFile({**device["known"], "kp": kp}, {}, {}).servo("", ""))
    return with_servos(robot, dict.fromkeys(joints, values), folder)
