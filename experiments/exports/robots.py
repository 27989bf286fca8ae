"""Robots for simulators: URDF, SDF, and values of actuators, with what each format cannot hold and how much that is."""

import json
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path

import numpy as np

from idbench.experiments.identification.consistent_robot import WrittenRobot
from idbench.experiments.identification.fit import Fit
from idbench.identify.basis.block import named
from idbench.sim.robot.tree import standard_parameters

EARTH = [0.0, 0.0, -9.81]  # Gravity as readers of these files have it
SMALLEST = 0.1  # Share of a joint's torque [%] from which on something that is missing is named


@dataclass(frozen=True)
class Exported:
    """What is written, and what is to be known of it."""

    texts: dict[Path, str]
    """Texts of the files: of that which was asked for, and of those that belong to it."""
    warnings: list[str] = field(default_factory=list)
    """What the files cannot hold, or what is wrong about them."""
    notes: list[str] = field(default_factory=list)
    """What else is to be said of them."""


def origin(fit: Fit, model: str) -> str:
    """What a file is from, in a sentence."""
    logs = ", ".join(fit.logs.names) or "a log"
    return f"identified from {logs} by {fit.request.estimator} of the {model} model, idbench {version('idbench')}"


def _marked(text: str, fit: Fit, model: str) -> str:
    """Return an XML file with a comment that says what it is from, below its declaration."""
    declared = text.index("?>") + 2 if text.startswith("<?xml") else 0
    before, after = text[:declared], text[declared:].lstrip("\n")
    comment = f"<!-- {re.sub(r'-(?=-)', '- ', origin(fit, model))} -->\n"  # two hyphens would end it
    return f"{before}\n{comment}{after}" if before else comment + after


def missing(written: WrittenRobot, letters: Sequence[str], coupled: bool = False) -> str:
    """Return what parameters of joints, or of coupled drives, make of each joint's torque in the logs; empty if nothing."""
    robot_model = written.fit.robot_model
    names = {p.name for p in robot_model.grouping.standard.parameters if p.symbol in letters and bool(p.drive) == coupled}
    joints, shares = robot_model.robot.joints, 100 * written.share_of(names)
    return ", ".join(f"{joint} {x:.2g} %" for joint, x in zip(joints, shares, strict=True) if x > SMALLEST)


def mjcf(fit: Fit, model: str, path: Path) -> Exported:
    """The robot's file with the parameters, made physically consistent."""
    written = WrittenRobot(fit, model)
    return Exported({path: _marked(written.text(path.absolute().parent), fit, model)}, written.warnings)


def urdf(fit: Fit, model: str, path: Path) -> Exported:
    """The robot as URDF with the parameters, and what readers of it do not have."""
    from idbench.sim.robot.write_urdf import urdf_text

    written, robot_model = WrittenRobot(fit, model), fit.robot_model
    text = urdf_text(robot_model.name, robot_model.robot, robot_model.tree, written.values, robot_model.mounting)
    lost = [*_unread(written, "most readers of a URDF"), *_springs(written), *_turned(written)]
    return Exported({path: _marked(text, fit, model)}, [*written.warnings, *lost])


def sdf(fit: Fit, model: str, path: Path) -> Exported:
    """The robot as SDF with the parameters, and what readers of it do not have."""
    from idbench.sim.robot.write_sdf import sdf_text

    written, robot_model = WrittenRobot(fit, model), fit.robot_model
    text = sdf_text(robot_model.robot, robot_model.tree, written.values)
    return Exported({path: _marked(text, fit, model)}, [*written.warnings, *_unread(written, "Gazebo"), *_turned(written)])


def _unread(written: WrittenRobot, reader: str) -> list[str]:
    found = []
    if drives := missing(written, ("Ia", "Fv", "Fs", "Fsx", "K"), coupled=True):
        found.append(f"drives that turn with several joints have no place in the file; they are of the logs' torques: {drives}")
    if rotors := missing(written, ("Ia",)):
        found.append(f"rotors are left out by {reader}, not by Drake and idbench; of the logs' torques they are: {rotors}")
    if friction := missing(written, ("Fs",)):
        found.append(f"Drake has no Coulomb friction, which is of the logs' torques: {friction}")
    return found


def _springs(written: WrittenRobot) -> list[str]:
    share = missing(written, ("K",))
    return [f"a URDF has no springs, which are of the logs' torques: {share}"] if share else []


def _turned(written: WrittenRobot) -> list[str]:
    gravity = [float(x) for x in written.fit.robot_model.tree.gravity]
    return [] if gravity == EARTH else [f"gravity {gravity} has no place in the file: set it in the simulation"]


def actuators(fit: Fit, model: str, path: Path) -> Exported:
    """What a training framework asks of each joint's actuator, as YAML, with standard errors."""
    written, robot = WrittenRobot(fit, model), fit.robot_model.robot
    estimate = fit.estimates[model]
    basis, errors = estimate.problem.basis, estimate.standard_errors
    sigma = {p.name: float(errors[place]) for p, place in basis.places.items()}  # of those that are tied, too
    most, known = robot.most("velocity"), standard_parameters(robot)
    lines = [
        f"# {fit.robot_model.tree.name}: {', '.join(fit.logs.names)}, {model} model, idbench {version('idbench')}.",
        "# armature [kg m^2], frictionloss [N m], damping [N m s/rad]; of slides kg, N, N s/m. null: not known.",
        "joints:",
    ]
    for j, joint in enumerate(robot.joints):
        lines.append(f"  {json.dumps(joint)}:")
        for key, letters in (("armature", "Ia"), ("frictionloss", "Fs"), ("damping", "Fv")):
            name = named(letters, j)
            value = written.values.get(name, known.get(name, 0.0))
            lines += [f"    {key}: {_or_null(value)}", f"    {key}_sigma: {_or_null(sigma.get(name))}"]
        lines += [f"    effort_limit: {_or_null(robot.torque_limits[j])}", f"    velocity_limit: {_or_null(most[j])}"]
    rotors = [name for j in range(robot.n) if written.values.get(name := named("Ia", j))]
    grouped = [name for name in rotors if name not in sigma and name not in fit.robot_model.held]
    aside = [f"{', '.join(grouped)}: grouped with inertias of links, the file's share of them is kept"] if grouped else []
    return Exported({path: "\n".join(lines) + "\n"}, [*written.warnings, *aside])


def _or_null(x: float | None) -> str:
    if x is None or not np.isfinite(x):
        return "null"
    text = repr(float(x))
    return text.replace("e", ".0e") if "e" in text and "." not in text else text  # or a reader of YAML 1.1 takes it for text
