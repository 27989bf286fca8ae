"""The files that an identification can be written to, and their table."""

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from importlib.metadata import version
from importlib.resources import files
from math import isfinite, nan
from pathlib import Path
from pprint import pformat
from typing import TYPE_CHECKING, Any

import numpy as np

from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.consistent_robot import WrittenRobot
from idbench.experiments.identification.fit import Fit
from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.results.writing import finite
from idbench.identify import AbstractBlock, AbstractFriction, Parameter, SettingError, ShapedFriction
from idbench.identify.basis import LoadFriction, OfJoints, SmoothFriction
from idbench.identify.basis.block import BODY, named
from idbench.identify.basis.friction.smooth import CENTRES, WIDTH
from idbench.identify.basis.of_joints import inner_of
from idbench.identify.data.kinematics import INERTIAL, Joint
from idbench.sim.robot.rewrite import rewritten

if TYPE_CHECKING:
    from idbench.identify import Array

LOAD = "np.abs(load) * np.sign(qd)"
"""Friction that grows with the load: the torque of a unit parameter, where `load` is the torque without friction."""

APART = ("Ia", "Fv", "Fs", "off")
"""Letters of what the function has by itself, beside the links."""


def lines_of(fit: Fit, values: Mapping[str, float]) -> list[str]:
    """Return the lines that add the laws to `tau`, each by its own `force`; `load` is the torque without friction."""
    n, lines = fit.basis.n, list[str]()
    for block in fit.basis.blocks:
        inner, law = inner_of(block), _law(block)
        if isinstance(law, SmoothFriction):
            lines += _smooth_lines(block, law, values, n)
            continue
        letters = getattr(law, "symbol", "Fl" if isinstance(law, LoadFriction) else "")
        if not letters or letters in APART or not any(named(letters, j) in values for j in range(n)):
            continue
        shapes = {shape.setting: shape.letters for shape in getattr(inner, "shapes", ())}
        text = LOAD if isinstance(law, LoadFriction) else law.source()
        each = {
            name: _array([values.get(named(shapes.get(name, ""), j), x) for j, x in enumerate(_fixed(law, name, n))])
            for name in _settings(law)
            if f"{{{name}}}" in text
        }
        torque = text.format(**each)
        lines.append(f"tau = tau + {_array([values.get(named(letters, j), 0.0) for j in range(n)])} * ({torque})")
    return lines


def _smooth_lines(block: AbstractBlock, law: SmoothFriction, values: Mapping[str, float], n: int) -> Iterator[str]:
    """Yield the line of each joint that adds its smooth function."""
    for j in block.joints if isinstance(block, OfJoints) else range(n):
        u = _array([values.get(named(f"u{k + 1}_", j), 0.0) for k in range(len(CENTRES))])
        x = f"np.arcsinh(qd[..., {j}, None] / {law.v!r}) - np.linspace({CENTRES[0]!r}, {CENTRES[-1]!r}, {len(CENTRES)})"
        yield f"tau[..., {j}] = tau[..., {j}] + np.exp(-(({x}) ** 2) / {2 * WIDTH**2!r}) @ {u}"


def _law(block: AbstractBlock) -> Any:
    """Return the law of a block, of some joints, with unknown shapes or without."""
    inner = inner_of(block)
    return inner.law if isinstance(inner, ShapedFriction) else inner


def _settings(law: Any) -> tuple[str, ...]:
    return tuple(each.name for each in fields(law)) if is_dataclass(law) else ()


def _fixed(law: Any, setting: str, n: int) -> list[float]:
    """Return what a setting of each joint is where it is no parameter."""
    values = np.ravel(np.asarray(getattr(law, setting), dtype=np.float64))
    if values.size not in (1, n):
        raise ExperimentError(f"{setting} of {type(law).__name__} has {values.size} values for {n} joints")
    return [float(x) for x in np.broadcast_to(values, (n,))]


def _array(values: list[float]) -> str:
    return f"np.array({[float(f'{x:.12g}') for x in values]})"


def _known(robot_model: RobotModel) -> set[str]:
    """Return the letters of what the function has beside the links; SettingError if a law's force cannot be written."""
    found = set(APART)
    for block in robot_model.basis.blocks:
        inner, law = inner_of(block), _law(block)
        if isinstance(law, AbstractFriction) and law.symbol not in APART:
            _ = law.source()
        if isinstance(law, AbstractFriction | LoadFriction | SmoothFriction):
            found |= set(inner.letters())  # type: ignore[attr-defined]  # both kinds of laws have letters
    return found


def standard_of(fit: Fit, model: str) -> dict[str, float]:
    """Return standard parameters with the torques of a model's estimate, by name.

    Base parameters stand for themselves, what is grouped with them is zero: no body need have them, but the torques are those
    of the estimate to the last digit.
    """
    robot_model, estimate = fit.robot_model, fit.estimates[model]
    grouping = robot_model.grouping
    values: Array = np.zeros(len(grouping.standard.names))
    for parameter, x in zip(estimate.problem.basis.parameters, estimate.X, strict=True):
        values[grouping.standard.places[parameter]] = x / parameter.scale
    return robot_model.equal(dict(zip(grouping.standard.names, map(float, values), strict=True)))


def require_known(robot_model: RobotModel, target: object) -> None:
    """Raise ExperimentError if a robot has what a controller's function does not: springs, other laws, coupled drives."""
    try:
        known = _known(robot_model)
    except SettingError as error:
        raise ExperimentError(f"{target}: {error}") from error
    strange = [p for p in robot_model.grouping.standard.parameters if p.kind not in BODY and (p.symbol not in known or p.drive)]
    if strange:
        names = ", ".join(parameter.name for parameter in strange[:6])
        raise ExperimentError(
            f"{target}: the function of a controller has links, rotors, laws of friction and offsets of joints, not {names}: "
            "write the .json, which has all columns, or leave out what makes them (--add, --friction, --coupling, springs)"
        )


ABOUT = (
    "tau = D(q, qd, qdd) X: X are `parameters`, each the sum of standard parameters in `made_of`. D has the columns of the "
    "standard parameters `column`, over `scale`: those of links from the tree (inertia about the origin of the link's frame "
    "and in its axes, first moments, mass), Ia: qdd of its joint, Fv: qd, Fs: sign(qd), off: 1. `torque_interval` has half "
    "widths of 95 % intervals of tau, and the speeds and torques that 99 % of the fit stayed below."
)


def json_text(fit: Fit, model: str) -> str:
    """Return the text: parameters, sigma, covariance, the tree of links, and which columns the regressor has."""
    robot_model, estimate = fit.robot_model, fit.estimates[model]
    standard = robot_model.grouping.standard
    parameters = [
        {
            "name": p.name,
            "value": float(x),
            "sigma": float(s),
            "unit": p.unit,
            "kind": p.kind,
            "joint": p.joint,
            "column": standard.names[standard.places[p]],
            "scale": p.scale,
            "made_of": _made_of(fit, p),
        }
        for p, x, s in zip(fit.basis.parameters, estimate.X, estimate.standard_errors, strict=True)
    ]
    content = {
        "format": "idbench base parameters 1",
        "version": version("idbench"),
        "about": ABOUT,
        "robot": robot_model.tree.name,
        "model": model,
        "estimator": fit.request.estimator,
        "logs": list(fit.logs.names),
        "parameters": parameters,
        "covariance": np.asarray(estimate.covariance).tolist(),
        "torque_interval": {name: [finite(x) for x in of] for name, of in _interval(fit, model).items()},
        "letters_of_links": list(INERTIAL),
        "gravity": [float(x) for x in robot_model.tree.gravity],
        "tree": [
            {
                "joint": joint.name,
                "kind": joint.kind,
                "parent": joint.parent,
                "position": joint.position.tolist(),
                "rotation": joint.rotation.tolist(),
                "axis": joint.axis.tolist(),
                "anchor": joint.anchor.tolist(),
                "zero": float(joint.zero),
            }
            for joint in robot_model.tree.joints
        ],
    }
    return json.dumps(content, indent=1, allow_nan=False) + "\n"


def _made_of(fit: Fit, parameter: Parameter) -> dict[str, float]:
    """Return the standard parameters of a base parameter, and their factors."""
    base = fit.robot_model.grouping
    row = base.K[base.parameters.index(parameter)]
    return {base.standard.names[k]: float(row[k]) for k in np.flatnonzero(row)}


def python_text(fit: Fit, model: str, target: Path) -> str:
    """Return the module: recursive Newton and Euler, with the parameters of a model's estimate.

    Raises
    ------
    ExperimentError
        If the estimate has a law of friction that the function does not have.
    """
    require_known(fit.robot_model, target)
    tree, values = fit.robot_model.tree, standard_of(fit, model)
    n = tree.n
    each = {x: [values.get(named(x, j), 0.0) for j in range(n)] for x in ("Ia", "Fv", "Fs", "off")}
    text = files("idbench.experiments.exports").joinpath("inverse_dynamics.py.txt").read_text(encoding="utf-8")
    words = {
        "{laws}": "".join(f"    {line}\n" for line in lines_of(fit, values)),
        "{name}": tree.name,
        "{version}": version("idbench"),
        "{logs}": ", ".join(fit.logs.names) or "a log",
        "{n}": str(n),
        "{joints}": pformat(tuple(joint.name for joint in tree.joints), width=110),
        "{model!r}": repr(model),
        "{estimator!r}": repr(fit.request.estimator),
        "{gravity}": repr([float(x) for x in tree.gravity]),
        "{tree}": pformat([_joint(joint) for joint in tree.joints], width=110),
        "{links}": pformat([[values.get(named(x, j), 0.0) for x in INERTIAL] for j in range(n)], width=110),
        **{f"{{{x}}}": repr(of) for x, of in each.items()},
        **{f"{{{x}}}": _numbers(of) for x, of in _interval(fit, model).items()},
    }
    for mark, word in words.items():
        text = text.replace(mark, word)
    return text


def _interval(fit: Fit, model: str) -> dict[str, list[float]]:
    """Return the half widths of the torques' intervals, and the fitted speeds and torques; NaN where they are not known."""
    interval, nothing = fit.torque_intervals[model], [nan] * fit.basis.n
    if interval is None:
        return dict.fromkeys(("half", "speed", "torque"), nothing)
    return {name: getattr(interval, name).tolist() for name in ("half", "speed", "torque")}


def _numbers(values: list[float]) -> str:
    return f"[{', '.join(f'{x:.6g}' if isfinite(x) else 'np.nan' for x in values)}]"


def _joint(joint: Joint) -> tuple[object, ...]:
    """Return a joint as the function has it."""
    lists = (joint.position, joint.rotation, joint.axis, joint.anchor)
    return (joint.parent, joint.kind == "slide", *(x.tolist() for x in lists), float(joint.zero))


Exported = tuple[str, list[str]]
"""A file's text, and what is to be known of it."""

EARTH = [0.0, 0.0, -9.81]
"""Gravity as readers of a URDF have it."""


def mjcf(fit: Fit, model: str, path: Path) -> Exported:
    """Return the robot's file with the parameters, made physically consistent."""
    written = WrittenRobot(fit, model)
    return written.text(path.absolute().parent), written.warnings


def urdf(fit: Fit, model: str, path: Path) -> Exported:
    """Return the robot as URDF with the parameters."""
    from idbench.sim.robot.write_urdf import urdf_text

    written, robot_model = WrittenRobot(fit, model), fit.robot_model
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
