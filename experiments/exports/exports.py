"""The files that an identification can be written to, and their table."""

import json
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from importlib.metadata import version
from math import nan
from pathlib import Path

import numpy as np

from idbench.experiments.errors import ExperimentError
from idbench.experiments.exports.c_code import c_texts
from idbench.experiments.exports.code import BAND, TRAINING, Content
from idbench.experiments.exports.functions import require_formulas
from idbench.experiments.exports.joint_files import actuators_text, cogging_map, require_cogging, sysid_text
from idbench.experiments.exports.python_code import python_text
from idbench.experiments.identification.consistent_robot import WrittenRobot
from idbench.experiments.identification.fit import Fit
from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.results.writing import finite, require_free, require_free_folder
from idbench.identify.data.kinematics import INERTIAL
from idbench.sim.robot.rewrite import rewritten

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
    unknown = f"; NOTHING IS KNOWN of {', '.join(fit.still)}, which never moved" if fit.still else ""
    by = f"{fit.request.method.estimator_name} of the {model} model"
    return f"identified from {logs} by {by}, idbench {version('idbench')}{unknown}"


def _marked(text: str, fit: Fit, model: str) -> str:
    """Return an XML file with a comment that says what it is from, below its declaration."""
    declared = text.index("?>") + 2 if text.startswith("<?xml") else 0
    before, after = text[:declared], text[declared:].lstrip("\n")
    comment = f"<!-- {re.sub(r'-(?=-)', '- ', origin(fit, model))} -->\n"  # two hyphens would end it
    return f"{before}\n{comment}{after}" if before else comment + after


def missing(written: WrittenRobot, letters: Sequence[str], coupled: bool = False) -> str:
    """Share of each joint's torque in the logs by parameters of joints, or of coupled drives; empty if there is none."""
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
    from idbench.sim.robot.written_xml import urdf_text

    written, robot_model = WrittenRobot(fit, model), fit.robot_model
    text = urdf_text(robot_model.name, robot_model.robot, robot_model.tree, written.values, robot_model.mounting)
    lost = _unread(written, "most readers of a URDF")
    if springs := missing(written, ("K",)):
        lost.append(f"a URDF has no springs, which are of the logs' torques: {springs}")
    return Exported({path: _marked(text, fit, model)}, [*written.warnings, *lost, *_turned(written)])


def sdf(fit: Fit, model: str, path: Path) -> Exported:
    """The robot as SDF with the parameters, and what readers of it do not have."""
    from idbench.sim.robot.written_xml import sdf_text

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


def _turned(written: WrittenRobot) -> list[str]:
    gravity = [float(x) for x in written.fit.robot_model.tree.gravity]
    return [] if gravity == EARTH else [f"gravity {gravity} has no place in the file: set it in the simulation"]


def of_joints(text: Callable[[WrittenRobot], str]) -> Callable[[Fit, str, Path], Exported]:
    """Return what writes a text of the joints of the robot."""

    def render(fit: Fit, model: str, path: Path) -> Exported:
        written = WrittenRobot(fit, model)
        return Exported({path: text(written)}, written.warnings)

    return render


FOLDER = ".ensemble"  # Ending of the name of a folder with robots


@dataclass(frozen=True)
class FileKind:
    """A kind of file."""

    what: str
    """What is in it, for a sentence."""
    render: Callable[[Fit, str, Path], Exported]
    """Returns the texts, with the parameters of a model."""
    require: Callable[[RobotModel, Path], object]
    """Raises an error before the work if a robot cannot be written so."""
    beside: tuple[str, ...] = ()
    """What replaces the ending in the names of the files that are written beside it."""

    def require_free(self, path: Path, option: str, *, force: bool, read: Sequence[Path] = ()) -> None:
        """Raise ResultsError if one of the files may not be written."""
        if path.suffix == FOLDER:
            require_free_folder(path, option, force=force)
            return
        for target in self.paths(path):
            require_free(target, option, force=force, read=read)

    def paths(self, path: Path) -> Iterator[Path]:
        """Yield all files that are written."""
        yield path
        yield from (path.with_name(path.stem + ending) for ending in self.beside)


ABOUT = (
    "tau = D(q, qd, qdd) X: X are `parameters`, each the sum of standard parameters in `made_of`. D has the columns of the "
    "standard parameters `column`, over `scale`: those of links from the tree (inertia about the origin of the link's frame "
    "and in its axes, first moments, mass), Ia: qdd of its joint, Fv: qd, Fs: sign(qd), off: 1. `torque_interval` has half "
    "widths of 95 % intervals of tau, and the speeds and torques that 99 % of the fit stayed below."
)


def base_parameters(fit: Fit, model: str, path: Path) -> Exported:
    """Return base parameters, their covariance and what the regressor is made of."""
    return Exported({path: json_text(fit, model)})


def json_text(fit: Fit, model: str) -> str:
    """Return the text: parameters, sigma, covariance, the tree of links, and which columns the regressor has."""
    robot_model, estimate = fit.robot_model, fit.estimates[model]
    base, standard = robot_model.grouping, robot_model.grouping.standard
    made_of = [base.K[base.parameters.index(p)] for p in fit.basis.parameters]
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
            "made_of": {standard.names[k]: float(row[k]) for k in np.flatnonzero(row)},
        }
        for p, x, s, row in zip(fit.basis.parameters, estimate.X, estimate.standard_errors, made_of, strict=True)
    ]
    content = {
        "format": "idbench base parameters 1",
        "version": version("idbench"),
        "about": ABOUT,
        "robot": robot_model.tree.name,
        "model": model,
        "estimator": fit.request.method.estimator_name,
        "logs": list(fit.logs.names),
        "parameters": parameters,
        "covariance": np.asarray(estimate.covariance).tolist(),
        "torque_interval": {name: [finite(x) for x in of] for name, of in interval_of(fit, model).items()},
        "letters_of_links": list(INERTIAL),
        "gravity": [float(x) for x in robot_model.tree.gravity],
        "tree": [
            {"joint": joint.name, "kind": joint.kind, "parent": joint.parent, "zero": float(joint.zero)}
            | {name: getattr(joint, name).tolist() for name in ("position", "rotation", "axis", "anchor")}
            for joint in robot_model.tree.joints
        ],
    }
    return json.dumps(content, indent=1, allow_nan=False) + "\n"


def interval_of(fit: Fit, model: str) -> dict[str, list[float]]:
    """Return the half widths of the torques' intervals, the fitted speeds and torques, and the band [Hz]; NaN if not known."""
    interval, nothing = fit.torque_intervals[model], [nan] * fit.basis.n
    if interval is None:
        return dict.fromkeys(("half", "speed", "torque"), nothing) | {"band": [nan]}
    return {name: getattr(interval, name).tolist() for name in ("half", "speed", "torque")} | {"band": [interval.band]}


def python_module(fit: Fit, model: str, path: Path) -> Exported:
    """Return the functions of the robot as a module of Python."""
    return Exported({path: python_text(_content(fit, model, path))})


def c_source(fit: Fit, model: str, path: Path) -> Exported:
    """Return the functions of the robot in C, and their header."""
    return Exported({path.with_suffix(end): x for end, x in c_texts(_content(fit, model, path), path).items()})


def drawn(fit: Fit, model: str, path: Path) -> Exported:
    """Return robots drawn from what the estimate leaves open: in a folder, or as data, with code that takes them."""
    from idbench.experiments.exports import ranges
    from idbench.experiments.exports.ensemble import ensemble_of, notes, robot_texts

    robots, written = ensemble_of(fit, model), WrittenRobot(fit, model)
    if path.suffix == FOLDER:
        return Exported(robot_texts(robots, path), written.warnings, notes(robots))
    drives = missing(written, ("Ia", "Fv", "Fs", "Fsx", "K"), coupled=True) or missing(written, ("K",))
    lost = [f"springs, and drives that turn with several joints, stay as in the file: {drives}"] if drives else []
    return Exported(ranges.texts(robots, path), [*written.warnings, *lost], notes(robots))


def _content(fit: Fit, model: str, path: Path) -> Content:
    estimate = fit.estimates[model]
    functions = require_formulas(estimate.problem.basis, fit.robot_model.tree, path)
    values, sigma = estimate.X.tolist(), estimate.standard_errors.tolist()
    return Content(functions, values, sigma, interval_of(fit, model), origin(fit, model))


def require_functions(robot_model: RobotModel, path: Path) -> None:
    """Raise ExperimentError if a part of the robot cannot be written as formulas."""
    require_formulas(robot_model.basis, robot_model.tree, path)


def require_written_back(robot_model: RobotModel, path: Path) -> None:
    """Raise BenchError if the file of a robot cannot be written with parameters of one's own choice."""
    rewritten(robot_model.name, {}, path.absolute().parent, robot_model.mounting)


EXPORTS: dict[str, FileKind] = {
    ".xml": FileKind("the robot", mjcf, require_written_back),
    ".urdf": FileKind("the robot", urdf, require_written_back),
    ".sdf": FileKind("the robot", sdf, require_written_back),
    ".yaml": FileKind("values of the joints' actuators", of_joints(actuators_text), require_written_back),
    ".json": FileKind("base parameters and regressor", base_parameters, lambda *_: None),
    "sysid.py": FileKind("parameters for mujoco.sysid", of_joints(sysid_text), require_written_back),
    "cogmap.csv": FileKind("the joints' cogging", lambda *of: Exported({of[2]: cogging_map(*of)}), require_cogging),
    ".py": FileKind("dynamics and regressors in Python", python_module, require_functions),
    ".c": FileKind("dynamics and regressors in C, with their header,", c_source, require_functions, (".h",)),
    ".toml": FileKind("robots drawn from what is not known, with code,", drawn, require_written_back, (*TRAINING, BAND)),
    FOLDER: FileKind("robots drawn from what is not known", drawn, require_written_back),
}
"""What is written, by the ending of its name."""


def kind_of(path: Path, option: str) -> FileKind:
    """Kind of file that a name asks for, by the longest ending; ExperimentError if there is none."""
    endings = [ending for ending in EXPORTS if path.name.endswith(ending) and path.suffix]
    if not endings:
        raise ExperimentError(f"{option} {path}: its name must end with {', '.join(EXPORTS)}")
    return EXPORTS[max(endings, key=len)]
