"""The command that shows what can be identified of a robot."""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from math import isfinite
from typing import Any

import numpy as np
from rich.console import Console
from rich.text import Text

from idbench.experiments.cli.command import with_own_parts
from idbench.experiments.cli.options.tools import DescribeRobot
from idbench.experiments.identification.robot_model import RobotModel, absolute
from idbench.experiments.judgement.warnings import FILE, warnings_of_robot
from idbench.experiments.reports.budget import largest_torques
from idbench.experiments.results.page import Page
from idbench.experiments.results.writing import finite
from idbench.experiments.text import new_table, print_titled
from idbench.identify import Array, Basis
from idbench.identify.basis.operations import COLUMNS, Operations, operations
from idbench.identify.blame import is_mistake
from idbench.sim.errors import BenchError
from idbench.sim.trajectories import RandomMoves

MANY = 30  # Joints from which on a line says that grouping takes its time: it grows with their cube


def describe(options: DescribeRobot) -> None:
    """Show what can be identified of a robot."""
    asked, page = with_own_parts(options), Page(machine=options.json)
    robot_model = RobotModel(absolute(asked.name), asked.parameters, asked.mounting.mounting)
    robot_model.require_laws()
    robot_model.check()
    if robot_model.robot.n > MANY:
        sys.stderr.write(f"idbench: grouping the parameters of {robot_model.robot.n} joints takes a while\n")
    truth = robot_model.truth(robot_model.robot)
    _print_joints(page, robot_model)
    counts = _operations(robot_model.basis)
    _print_parameters(page, robot_model, truth, counts)
    try:
        moves = RandomMoves(moves=20, durations=(0.8, 1.6), velocity=(2.0,)).sample(robot_model.robot, 100.0)
        _print_budget(page, robot_model.robot.joints, largest_torques(robot_model.robot, moves))
    except BenchError as error:  # the parameters are worth knowing all the same
        page.print(Text(f"no torque budget: {error}"), soft_wrap=True)
    page.warn({FILE: warnings_of_robot(robot_model.robot)})
    page.found |= _summary(robot_model, truth, counts)
    page.close()


def _summary(robot_model: RobotModel, truth: dict[str, float], counts: dict[str, Operations]) -> dict[str, Any]:
    """Content of --json for a robot."""
    return {
        "robot": robot_model.name,
        "joints": [{"name": j.name, "kind": j.kind, "range": [finite(x) for x in j.range]} for j in robot_model.tree.joints],
        "parameters": [
            {"name": p.name, "unit": p.unit, "kind": p.kind, "joint": p.joint, "value": truth[p.name]}
            for p in robot_model.basis.parameters
        ],
        "operations": {model: asdict(each) for model, each in counts.items()},
        "made_of": robot_model.grouping.groupings,
    }


def _print_joints(page: Console, robot_model: RobotModel) -> None:
    tree, found = robot_model.tree, robot_model.robot
    grid = new_table("", ["kind", "on", "from [rad, m]", "to", "armature", "Fv", "Fs"])
    model = found.model
    for j, joint in enumerate(tree.joints):
        values = model.dof_armature[j], model.dof_damping[j], model.dof_frictionloss[j]
        parent = tree.joints[joint.parent].name if joint.parent >= 0 else "ground"
        ends = (f"{x:.4g}" if isfinite(x) else "" for x in joint.range)
        grid.add_row(f"{j + 1} {joint.name}", joint.kind, parent, *ends, *(f"{x:g}" if x else "" for x in values))
    print_titled(page, f"robot {tree.name}: {tree.n} joints on a base that is fixed to the ground", grid)
    if not any(joint.armature for joint in tree.joints):
        asked, filed = robot_model.asked.armature != "none", model.dof_armature.any()
        why = "the file has no armatures" if asked else "no armature is identified (--armature none)"
        more = "" if filed else "; behind gears rotors have more inertia than links: --armature all"
        page.print(Text(why + more))


def _print_parameters(page: Console, robot_model: RobotModel, truth: dict[str, float], counts: dict[str, Operations]) -> None:
    basis, base = robot_model.basis, robot_model.grouping
    grid = new_table("", ["of the file", "unit"])
    grid.add_column("made of")
    for parameter, unit in zip(basis.names, basis.units, strict=True):
        grid.add_row(parameter, f"{truth[parameter]:.5g}", unit, base.groupings[parameter])
    print_titled(page, f"{len(basis.names)} parameters that a motion can identify", grid)
    if base.without_effect:
        page.print(Text(f"no motion excites {', '.join(base.without_effect)}"), soft_wrap=True)
    if counts:
        page.print(Text(f"operations per sample: {'; '.join(f'{model} {x}' for model, x in counts.items())}"), soft_wrap=True)
    page.print()


def _operations(basis: Basis) -> dict[str, Operations]:
    """Return the operations of each model's columns; none where a law or block cannot be evaluated on symbols."""
    try:
        return {model: operations(basis, model) for model in COLUMNS}
    except BaseException as error:  # whatever a plug-in does with what is no number
        if not is_mistake(error):
            raise
        return {}


def _print_budget(page: Console, joints: Sequence[str], largest: Mapping[str, Array]) -> None:
    grid = new_table("", largest)
    for j, joint in enumerate(joints):
        values = [value[j] for value in largest.values()]
        grid.add_row(joint, *(f"{value:.3g}" if np.isfinite(value) else "" for value in values))
    motion = "along 20 random moves of 0.8 to 1.6 s, at most 2 rad/s or m/s"
    print_titled(page, f"torque budget: largest [N m, N of slides] {motion}", grid)
