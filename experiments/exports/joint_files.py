"""Files of what joints have: values for actuators, parameters for mujoco.sysid, and a map of their cogging."""

import json
from importlib.metadata import version
from pathlib import Path
from pprint import pformat
from string import Template

import numpy as np

from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.consistent_robot import WrittenRobot
from idbench.experiments.identification.fit import Fit
from idbench.experiments.identification.robot_model import RobotModel
from idbench.identify import Basis, State
from idbench.identify.basis import Cogging
from idbench.identify.basis.block import AbstractBlock, named
from idbench.identify.basis.of_joints import block_of_all_joints
from idbench.sim.robot.rewrite import DRIVE
from idbench.sim.robot.tree import standard_parameters

FIELDS = {what: letters for letters, what in DRIVE.items() if letters != "K"}  # What MuJoCo calls what a drive has, its letters
NORMAL = 1.96  # Standard errors of half a 95 % interval

SYSID = Template('''"""Parameters of $about, for mujoco.sysid: bounds are 95 % intervals, shares of sums are frozen.

    model = sysid.apply_param_modifiers(parameters(), mujoco.MjSpec.from_file("arm.xml"))
"""

from mujoco import sysid

JOINTS = $joints  # joint -> field: value, low, high


def _written(joint, field):
    def modify(spec, parameter):
        old, value = getattr(spec.joint(joint), field), float(parameter.value[0])
        setattr(spec.joint(joint), field, [value, *old[1:]] if hasattr(old, "__len__") else value)

    return modify


def parameters():
    """Return armature, friction and damping of all joints as a ParameterDict."""
    found = sysid.ParameterDict()
    for joint, fields in JOINTS.items():
        for field, (value, low, high) in fields.items():
            modify, frozen = _written(joint, field), low == high
            found.add(sysid.Parameter(f"{joint}_{field}", value, low, high, frozen=frozen, modifier=modify))
    return found
''')
"""Code of a file of parameters."""


def _about(written: WrittenRobot) -> str:
    fit = written.fit
    return f"{fit.robot_model.tree.name}: {', '.join(fit.logs.names)}, {written.model} model, idbench {version('idbench')}"


def actuators_text(written: WrittenRobot) -> str:
    """What a training framework asks of each joint's actuator, as YAML, with standard errors."""
    robot = written.fit.robot_model.robot
    most, known = robot.most("velocity"), standard_parameters(robot)
    lines = [
        f"# {_about(written)}.",
        "# armature [kg m^2], frictionloss [N m], damping [N m s/rad]; of slides kg, N, N s/m. null: not known.",
        "# from: log; sum: a share of what the log shows, as near to the robot's file as that allows; stated; file.",
        "joints:",
    ]
    for j, joint in enumerate(robot.joints):
        lines.append(f"  {json.dumps(joint)}:")
        for key, letters in FIELDS.items():
            name = named(letters, j)
            value, sigma = written.values.get(name, known.get(name, 0.0)), written.sigma.get(name)
            found = {key: _or_null(value), f"{key}_sigma": _or_null(sigma), f"{key}_from": written.source(name)}
            lines += [f"    {what}: {x}" for what, x in found.items()]
        lines += [f"    effort_limit: {_or_null(robot.torque_limits[j])}", f"    velocity_limit: {_or_null(most[j])}"]
    return "\n".join(lines) + "\n"


def _or_null(x: float | None) -> str:
    if x is None or not np.isfinite(x):
        return "null"
    text = repr(float(x))
    return text.replace("e", ".0e") if "e" in text and "." not in text else text  # or a reader of YAML 1.1 takes it for text


def sysid_text(written: WrittenRobot) -> str:
    """Python file of parameters for mujoco.sysid, with their 95 % intervals."""
    joints = dict[str, dict[str, tuple[float, float, float]]]()
    for j, joint in enumerate(written.fit.robot_model.robot.joints):
        for key, letters in FIELDS.items():
            x, sigma = float(written.values.get(name := named(letters, j), 0.0)), written.sigma.get(name, 0.0)
            off = NORMAL * sigma if np.isfinite(sigma) else 0.0
            joints.setdefault(joint, {})[key] = x, max(x - off, 0.0), x + off
    return SYSID.substitute(about=_about(written).replace("\\", "/").replace('"', "'"), joints=pformat(joints))


POINTS = 3600  # In a turn: 40 in each of the 90 waves that are looked for at most


def waves_of(basis: Basis) -> list[AbstractBlock]:
    """Blocks of cogging."""
    return [block for block in basis.blocks if isinstance(block_of_all_joints(block), Cogging)]


def require_cogging(robot_model: RobotModel, path: Path) -> None:
    """Raise ExperimentError if no joint has cogging; where the log chooses the laws, that is known after the fit."""
    if not robot_model.laws.auto and not waves_of(robot_model.basis):
        raise ExperimentError(f"{path}: no joint has cogging: add it, as in --friction standard+cogging:12, or --friction auto")


def cogging_map(fit: Fit, model: str, path: Path) -> str:
    """Table of joint, position [rad], torque and its standard error [N m] over a turn."""
    estimate, joints = fit.estimates[model], fit.robot_model.robot.joints
    q = np.linspace(0, 2 * np.pi, POINTS, endpoint=False)
    still = State(np.tile(q, (len(joints), 1)), np.zeros((len(joints), POINTS)), np.zeros_like)
    columns = [x for block in waves_of(estimate.problem.basis) for x in block.explicit(still).items()]
    places, lines = estimate.problem.basis.places, ["joint,position,torque,sigma"]
    for j, joint in enumerate(joints):
        if own := {places[p]: column for (row, p), column in columns if row == j and p in places}:
            W, at = np.stack(list(own.values()), axis=1), list(own)
            sigma = np.sqrt(np.einsum("qi,ij,qj->q", W, estimate.covariance[np.ix_(at, at)], W))
            lines += [f"{joint},{x:.6g},{tau:.6g},{s:.3g}" for x, tau, s in zip(q, W @ estimate.X[at], sigma, strict=True)]
    if len(lines) == 1:
        raise ExperimentError(f"{path}: no cogging was found")
    return "\n".join(lines) + "\n"
