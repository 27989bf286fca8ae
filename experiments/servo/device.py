"""Servos that were identified from public logs: what others measured, with standard errors, as files for a robot."""

import json
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from idbench.experiments.errors import ExperimentError
from idbench.experiments.servo.servo_files import values_of
from idbench.identify.files.servo_file import ServoFile
from idbench.identify.plugins import did_you_mean
from idbench.sim.robot.servos import with_servos

BENCH = "pendulum"  # Robot to whose joint a servo is written where none is named


@cache
def devices() -> dict[str, dict[str, Any]]:
    """Devices that ship, by their names."""
    folder = files("idbench.experiments.servo").joinpath("devices")
    found = [json.loads(path.read_text(encoding="utf-8")) for path in folder.iterdir() if path.name.endswith(".json")]
    return {device["name"]: device for device in sorted(found, key=lambda device: str(device["name"]))}


def device_of(name: str) -> dict[str, Any]:
    """A device; raise ExperimentError if none has this name."""
    every = devices()
    if name not in every:
        raise ExperimentError(f"there is no device {name!r}{did_you_mean(name, every)}; there are {', '.join(every)}")
    return every[name]


def servo_toml_of(device: Mapping[str, Any]) -> str:
    """A servo.toml of a device, and the words that hold its parameters in a fit."""
    known = "\n".join(f"{key} = {json.dumps(x)}" for key, x in device["known"].items())
    held = " ".join(f"{letter}={of['value']:.4g}" for letter, of in device["parameters"].items() if letter in ("a", "b"))
    return f"# {device['name']}: {device['source']}\n# a joint without a known load: --hold {held}\n{known}\nkp = 16  # yours\n"


def mjcf_of_device(device: Mapping[str, Any], robot: str, joints: Sequence[int], kp: float, folder: Path) -> str:
    """A robot's MJCF with the device at joints, by their numbers, and a gain of its firmware."""
    p = {letter: of["value"] for letter, of in device["parameters"].items()}
    values = values_of(p, ServoFile({**device["known"], "kp": kp}, {}, {}).servo("", ""))
    return with_servos(robot, dict.fromkeys(joints, values), folder)
