"""Robots for simulators: URDF, SDF, and values of actuators, with what each format cannot hold and how much that is."""

import json
from collections.abc import Sequence
from importlib.metadata import version

import numpy as np

from idbench.experiments.identification.consistent_robot import WrittenRobot
from idbench.experiments.identification.fit import Fit
from idbench.identify.basis.block import named
from idbench.sim.robot.tree import standard_parameters

EARTH = [0.0, 0.0, -9.81]  # Gravity as readers of these files have it
SMALLEST = 0.1  # Share of a joint's torque [%] from which on something that is missing is named


def missing(written: WrittenRobot, letters: Sequence[str], coupled: bool = False) -> str:
    """Return what parameters of joints, or of coupled drives, make of each joint's torque in the logs; empty if nothing."""
    robot_model = written.fit.robot_model
    names = {p.name for p in robot_model.grouping.standard.parameters if p.symbol in letters and bool(p.drive) == coupled}
    joints, shares = robot_model.robot.joints, 100 * written.share_of(names)
    return ", ".join(f"{joint} {x:.2g} %" for joint, x in zip(joints, shares, strict=True) if x > SMALLEST)


def urdf(written: WrittenRobot) -> tuple[str, list[str]]:
    """Return the robot as URDF, and what readers of it do not have."""
    from idbench.sim.robot.write_urdf import urdf_text

    robot_model = written.fit.robot_model
    text = urdf_text(robot_model.name, robot_model.robot, robot_model.tree, written.values, robot_model.mounting)
    return text, [*written.warnings, *_unread(written, "most readers of a URDF"), *_springs(written), *_turned(written)]


def sdf(written: WrittenRobot) -> tuple[str, list[str]]:
    """Return the robot as SDF, and what readers of it do not have."""
    from idbench.sim.robot.write_sdf import sdf_text

    robot_model = written.fit.robot_model
    text = sdf_text(robot_model.robot, robot_model.tree, written.values)
    return text, [*written.warnings, *_unread(written, "Gazebo"), *_turned(written)]


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


def actuators(fit: Fit, model: str) -> tuple[str, list[str]]:
    """Return what a training framework asks of each joint's actuator, as YAML, with standard errors."""
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
        for field, letters in (("armature", "Ia"), ("frictionloss", "Fs"), ("damping", "Fv")):
            name = named(letters, j)
            value = written.values.get(name, known.get(name, 0.0))
            lines += [f"    {field}: {_or_null(value)}", f"    {field}_sigma: {_or_null(sigma.get(name))}"]
        lines += [f"    effort_limit: {_or_null(robot.torque_limits[j])}", f"    velocity_limit: {_or_null(most[j])}"]
    rotors = [name for j in range(robot.n) if written.values.get(name := named("Ia", j))]
    grouped = [name for name in rotors if name not in sigma and name not in fit.robot_model.held]
    aside = [f"{', '.join(grouped)}: grouped with inertias of links, the file's share of them is kept"] if grouped else []
    return "\n".join(lines) + "\n", [*written.warnings, *aside]


def _or_null(x: float | None) -> str:
    if x is None or not np.isfinite(x):
        return "null"
    text = repr(float(x))
    return text.replace("e", ".0e") if "e" in text and "." not in text else text  # or a reader of YAML 1.1 takes it for text
