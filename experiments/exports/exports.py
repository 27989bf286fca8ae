"""The files that an identification can be written to, and their table."""

from collections.abc import Callable
from pathlib import Path

from idbench.experiments.exports.base_json import json_text
from idbench.experiments.exports.controller import python_text
from idbench.experiments.exports.standard import require_known
from idbench.experiments.identification.consistent_robot import Written
from idbench.experiments.identification.fit import Fit
from idbench.experiments.identification.robot_model import RobotModel
from idbench.sim.robot.rewrite import rewritten

Exported = tuple[str, list[str]]
"""A file's text, and what is to be known of it."""

EARTH = [0.0, 0.0, -9.81]
"""Gravity as readers of a URDF have it."""


def mjcf(fit: Fit, model: str, path: Path) -> Exported:
    """Return the robot's file with the parameters, made physically consistent."""
    written = Written(fit, model)
    return written.text(path.absolute().parent), written.warnings


def urdf(fit: Fit, model: str, path: Path) -> Exported:
    """Return the robot as URDF with the parameters."""
    from idbench.sim.robot.write_urdf import urdf_text

    written, robot_model = Written(fit, model), fit.robot_model
    drives = [p.name for p in robot_model.grouping.standard.parameters if p.kind in ("rotor inertia", "stiffness")]
    left = [name for name in drives if written.values.get(name)]
    lost = [f"{', '.join(left)} have no place in a URDF: rotors and springs are left out of {path}"] if left else []
    turned = [float(x) for x in robot_model.tree.gravity] != EARTH
    aside = [f"gravity {robot_model.tree.gravity.tolist()} has no place in a URDF"] if turned else []
    text = urdf_text(robot_model.name, robot_model.robot, robot_model.tree, written.values, robot_model.mounting)
    return text, [*written.warnings, *lost, *aside]


def base_parameters(fit: Fit, model: str, path: Path) -> Exported:
    """Return base parameters, their covariance and what the regressor is made of."""
    del path
    return json_text(fit, model), []


def controller(fit: Fit, model: str, path: Path) -> Exported:
    """Return the inverse dynamics as a function that needs NumPy alone."""
    return python_text(fit, model, path), []


def require_written_back(robot_model: RobotModel, path: Path) -> None:
    """Raise BenchError if the file of a robot cannot be written with parameters of one's own choice."""
    rewritten(robot_model.name, {}, path.absolute().parent, robot_model.mounting)


def require_nothing(robot_model: RobotModel, path: Path) -> None:
    """Accept all robots."""
    del robot_model, path


EXPORTS: dict[str, tuple[str, Callable[[Fit, str, Path], Exported], Callable[[RobotModel, Path], None]]] = {
    ".xml": ("the robot", mjcf, require_written_back),
    ".urdf": ("the robot", urdf, require_written_back),
    ".json": ("base parameters and regressor", base_parameters, require_nothing),
    ".py": ("the inverse dynamics, for a controller,", controller, require_known),
}
"""What is written, by the ending of the name of its file, and what asks before the work whether a robot can be."""
