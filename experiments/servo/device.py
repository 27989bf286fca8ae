"""Servos that were identified from public logs: what others measured, with standard errors, as files for a robot."""

import json
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from idbench.experiments.errors import ExperimentError
from idbench.experiments.servo.servo_files import values_of
from idbench.identify.files.servo_file import ServoFile
from idbench.identify.plugins import did_you_mean
from idbench.identify.servo import ServoFit
from idbench.identify.servo.parameters import SERVO_PARAMETERS
from idbench.sim.robot.servos import with_servos

BENCH = "pendulum"  # Robot to whose joint a servo is written where none is named


def described(
    name: str, source: str, known: Mapping[str, Any], units: Sequence[ServoFit], held_out_error: float
) -> dict[str, Any]:
    """Content of a device's file.

    Parameters
    ----------
    name, source : str
        Its name, and where its logs are from.
    known : mapping of str to Any
        What servo.toml states of it.
    units : sequence of ServoFit
        The fit of each unit that was logged, with the same parameters.
    held_out_error : float
        Mean error of positions of runs that fits did not see [rad].
    """
    first = units[0]
    values = np.array([[fit.p[letter] for letter in first.p] for fit in units])
    sigma = first.standard_errors
    spread = np.std(values, axis=0, ddof=1) if len(units) > 1 else np.full(len(first.p), np.nan)
    return {
        "name": name,
        "source": source,
        "known": dict(known),
        "friction": first.friction,
        "units": len(units),
        "held_out_error": held_out_error,
        "parameters": {
            letter: {
                "value": float(np.mean(x)),
                "sigma": sigma.get(letter),
                "spread": None if np.isnan(s) else float(s),
                "unit": SERVO_PARAMETERS[letter].unit,
            }
            for letter, x, s in zip(first.p, values.T, spread, strict=True)
            if letter != "offset"  # of the bench, not of the servo
        },
        "free": list(first.free),
        "covariance": np.asarray(first.covariance).tolist(),
    }


@cache
def devices() -> dict[str, dict[str, Any]]:
    """Return the devices that ship, by their names."""
    folder = files("idbench.experiments.servo").joinpath("devices")
    found = [json.loads(path.read_text(encoding="utf-8")) for path in folder.iterdir() if path.name.endswith(".json")]
    return {device["name"]: device for device in sorted(found, key=lambda device: str(device["name"]))}


def device_of(name: str) -> dict[str, Any]:
    """Return a device; raise ExperimentError if none has this name."""
    every = devices()
    if name not in every:
        raise ExperimentError(f"there is no device {name!r}{did_you_mean(name, every)}; there are {', '.join(every)}")
    return every[name]


def servo_toml_of(device: Mapping[str, Any]) -> str:
    """Return a servo.toml of a device, and the words that hold its parameters in a fit."""
    known = "\n".join(f"{key} = {json.dumps(x)}" for key, x in device["known"].items())
    held = " ".join(f"{letter}={of['value']:.4g}" for letter, of in device["parameters"].items() if letter in ("a", "b"))
    return f"# {device['name']}: {device['source']}\n# a joint without a known load: --hold {held}\n{known}\nkp = 16  # yours\n"


def mjcf_of_device(device: Mapping[str, Any], robot: str, joints: Sequence[int], kp: float, folder: Path) -> str:
    """Return a robot's MJCF with the device at joints, by their numbers, and a gain of its firmware."""
    p = {letter: of["value"] for letter, of in device["parameters"].items()}
    values = values_of(p, ServoFile({**device["known"], "kp": kp}, {}, {}).servo("", ""))
    return with_servos(robot, dict.fromkeys(joints, values), folder)
