"""Robots of an ensemble as data, values and ranges of what is known of them one by one, and code for training frameworks."""

import json
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from idbench.experiments.errors import ExperimentError
from idbench.experiments.exports.code import BAND, TRAINING, template
from idbench.experiments.exports.ensemble import DRAWS, LENGTH, Ensemble, FreeRuns, fields_of
from idbench.experiments.exports.joint_files import FIELDS, NORMAL
from idbench.experiments.identification.consistent_robot import WrittenRobot
from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.reports.panels import Panel, stacked
from idbench.identify.basis.block import named
from idbench.sim.robot.varied import DRIVE

DIGITS = 9  # Significant digits: two more than the single precision of training frameworks

JOINT = {what: (letters, DRIVE[letters]) for what, letters in FIELDS.items()}  # What a joint has, letters, MuJoCo's field

BODY = {"mass": "body_mass", "com": "body_ipos", "inertia": "body_inertia", "quat": "body_iquat"}
"""What a body has -> MuJoCo's field."""

ALONE = 0.8  # Share of its variance that others leave a value with a range: drawn one by one, values err 12 % too much


def texts(ensemble: Ensemble, path: Path) -> dict[Path, str]:
    """Return the texts of the robots and ranges, and of the code that takes them, by their paths."""
    about = f"{ensemble.fit.robot_model.tree.name}, identified by idbench {version('idbench')}"
    made = {path: tomli_w.dumps(table_of(ensemble)) + _robots(ensemble)}
    for ending in TRAINING:
        text = template(f"ranges{ending}").substitute(about=about, draws=DRAWS, file=path.name)
        made[path.with_name(path.stem + ending)] = text
    if ensemble.bands:
        made[path.with_name(path.stem + BAND)] = picture(ensemble.bands[0], ensemble.fit.robot_model)
    return made


def picture(runs: FreeRuns, robot_model: RobotModel) -> str:
    """Return the band about a held-out log as SVG: how far free runs are from it, one run after the other."""
    panels = list[Panel]()
    count, samples, _ = runs.q.shape
    time = LENGTH * (np.arange(count)[:, None] + np.arange(samples) / samples)
    for j, (joint, held) in enumerate(zip(robot_model.robot.joints, runs.held, strict=True)):
        panel = Panel(f"{joint}: {100 * held:.0f} % of the instants held, width {runs.width[j]:.2g}")
        for edge, label in ((runs.low, "95 % of the robots"), (runs.high, "")):
            off = edge[..., j] - runs.q[..., j]
            off[:, 0] = np.nan  # no line from the end of a run to the next
            panel.line(time.ravel(), off.ravel(), "#2ca02c", 1.2, label)
        panel.line(np.array([0.0, LENGTH * count]), np.zeros(2), "#444444", 1.0, "log")
        panels.append(panel)
    units = {robot_model.units(j)[1] for j in range(robot_model.robot.n)}
    return stacked(panels, 1.5, "time of free runs [s]", f"robots - log [{', '.join(sorted(units))}]")


def table_of(ensemble: Ensemble) -> dict[str, Any]:
    """Return the value, sigma and range of what joints have, masses of bodies, and how well free runs hold the logs."""
    written = WrittenRobot(ensemble.fit, ensemble.model)
    robot = ensemble.fit.robot_model.robot
    mass = {int(body): named("M", j) for j, body in enumerate(robot.model.jnt_bodyid[: robot.n])}
    sizes, times = ensemble.disturbance
    joints: dict[str, Any] = {}
    for j, joint in enumerate(robot.joints):
        joints[joint] = {what: _value(ensemble, written, named(letters, j)) for what, (letters, _) in JOINT.items()}
        joints[joint]["disturbance"] = {"rms": _short(sizes[j]), "correlation_time": _short(times[j])}
    return {
        "about": (
            f"[[robots]]: {DRAWS} physically consistent robots (seed {ensemble.seed}), to be taken whole: values of [joints] "
            "and [bodies] in their order; quat (w x y z) of the principal inertia. Units: kg, m, kg m^2, N m, N m s/rad (of "
            "slides N, N s/m). disturbance: torque that the model does not explain [N m], the time over which it is alike [s]."
        ),
        "spread": _short(ensemble.spread),
        "free_run": LENGTH,
        "bands": [
            {
                "on": band.title,
                "held": dict(zip(robot.joints, map(_short, band.held), strict=True)),
                "width": dict(zip(robot.joints, map(_short, band.width), strict=True)),
            }
            for band in ensemble.bands
        ],
        "joints": joints,
        "bodies": {
            name: {"mass": _value(ensemble, written, mass[k]) if k in mass else {"value": 0.0, "from": "sum"}}
            for name, k in bodies_of(ensemble).items()
        },
    }


def bodies_of(ensemble: Ensemble) -> dict[str, int]:
    """Return the numbers of MuJoCo's bodies that joints move, and of those that are welded to them, by their names."""
    robot = ensemble.fit.robot_model.robot
    links, model = set(robot.model.jnt_bodyid[: robot.n].tolist()), robot.model
    found = {model.body(k).name: k for k in range(1, model.nbody) if int(model.body_weldid[k]) in links}
    if "" in found:
        raise ExperimentError("a link of the robot's file has no name, by which code could find it: name its body")
    return found


def _value(ensemble: Ensemble, written: WrittenRobot, name: str) -> dict[str, Any]:
    value = written.values.get(name, 0.0)
    found: dict[str, Any] = {"value": _short(value), "from": written.source(name)}
    if name not in written.sigma:
        return found
    C, sigma = ensemble.estimate.covariance, ensemble.spread * written.sigma[name]
    place = next(k for p, k in ensemble.estimate.problem.basis.places.items() if p.name == name)
    found["sigma"] = _short(sigma)
    if 1 / (C[place, place] * np.linalg.pinv(C, hermitian=True)[place, place]) >= ALONE:
        found |= {"low": _short(max(value - NORMAL * sigma, 0.0)), "high": _short(value + NORMAL * sigma)}
    return found


def _robots(ensemble: Ensemble) -> str:
    """Return the robots, a line for each of their values: a table that is written out has 20 000."""
    robot, bodies = ensemble.fit.robot_model.robot, list(bodies_of(ensemble).values())
    fields = fields_of(robot, ensemble.standard)
    columns = {what: fields[field][:, : robot.n] for what, (_, field) in JOINT.items()}
    columns |= {what: fields[field][:, bodies] for what, field in BODY.items()}
    rounded = {what: json.loads(json.dumps(values.tolist()), parse_float=_short) for what, values in columns.items()}
    each = ("\n".join(f"{what} = {json.dumps(own[k])}" for what, own in rounded.items()) for k in range(DRAWS))
    return "".join(f"\n[[robots]]\n{lines}\n" for lines in each)


def _short(x: Any) -> float:
    return float(f"{float(x):.{DIGITS}g}")
