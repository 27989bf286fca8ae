"""The files that an identification can be written to, and their table."""

from collections.abc import Callable
from pathlib import Path

from experiments.exports.base_json import json_text
from experiments.exports.controller import python_text
from experiments.identification.consistent_robot import Written
from experiments.identification.identified import Identified
from experiments.identification.results import write_whole

Warnings = list[str]

EARTH = [0.0, 0.0, -9.81]
"""Gravity as readers of a URDF have it."""


def write_mjcf(found: Identified, model: str, path: Path) -> Warnings:
    """Write the robot's file with the parameters; what of them bodies cannot have is said."""
    written = Written(found, model)
    written.write(path)
    return written.warnings


def write_urdf(found: Identified, model: str, path: Path) -> Warnings:
    """Write the robot as URDF with the parameters."""
    from sim.robot.write_urdf import urdf_text

    written, subject = Written(found, model), found.subject
    write_whole(path, urdf_text(subject.name, subject.robot, subject.tree, written.values, subject.mounting))
    rotors = [name for name, value in written.values.items() if name.startswith("Ia") and value]
    lost = [f"{', '.join(rotors)} have no place in a URDF: rotors are left out of {path}"] if rotors else []
    turned = [float(x) for x in subject.tree.gravity] != EARTH
    aside = [f"gravity {subject.tree.gravity.tolist()} has no place in a URDF"] if turned else []
    return [*written.warnings, *lost, *aside]


def write_json(found: Identified, model: str, path: Path) -> Warnings:
    """Write base parameters, their covariance and what the regressor is made of."""
    write_whole(path, json_text(found, model))
    return []


def write_python(found: Identified, model: str, path: Path) -> Warnings:
    """Write the inverse dynamics as a function that needs NumPy alone."""
    write_whole(path, python_text(found, model, path))
    return []


EXPORTS: dict[str, tuple[str, Callable[[Identified, str, Path], Warnings]]] = {
    ".xml": ("the robot", write_mjcf),
    ".urdf": ("the robot", write_urdf),
    ".json": ("base parameters and regressor", write_json),
    ".py": ("the inverse dynamics, for a controller,", write_python),
}
"""What is written, by the ending of the name of its file."""
