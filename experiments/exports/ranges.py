"""Ranges of an ensemble: a file of means, sigma, quantiles and correlations, and code for training frameworks."""

from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from idbench.experiments.exports.code import template
from idbench.experiments.exports.ensemble import DRAWS, LENGTH, Ensemble, FreeRuns, fields_of
from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.reports.panels import Panel, stacked
from idbench.identify import Array
from idbench.identify.arrays import TINY

CODE = ("_mjlab.py", "_isaaclab.py", "_playground.py")  # Endings of the names of code for training frameworks
PICTURE = "_band.svg"  # Ending of the name of the picture of the band
QUANTILES = {"low": 0.025, "middle": 0.5, "high": 0.975}
"""The middle of a value, and the ends of the range that holds 95 % of the robots."""

DIGITS = 6  # Significant digits: draws scatter by far more

JOINT = {"armature": "dof_armature", "damping": "dof_damping", "frictionloss": "dof_frictionloss"}
"""What a joint has -> MuJoCo's field."""


def texts(ensemble: Ensemble, path: Path) -> dict[Path, str]:
    """Return the texts of the ranges, and of the code that takes them, by their paths."""
    table = ranges(ensemble)
    about = f"{ensemble.fit.robot_model.tree.name}, identified by idbench {version('idbench')}"
    made = {path: tomli_w.dumps(table)}
    for ending in CODE:
        text = template(f"ranges{ending}").substitute(about=about, draws=DRAWS, tables=_tables(table))
        made[path.with_name(path.stem + ending)] = text
    if ensemble.bands:
        made[path.with_name(path.stem + PICTURE)] = picture(ensemble.bands[0], ensemble.fit.robot_model)
    return made


def picture(runs: FreeRuns, robot_model: RobotModel) -> str:
    """Return the band about a held-out log as SVG: how far free runs are from it, one run after the other."""
    panels = list[Panel]()
    count, samples, _ = runs.q.shape
    time = LENGTH * (np.arange(count)[:, None] + np.arange(samples) / samples)
    for j, (joint, held) in enumerate(zip(robot_model.robot.joints, runs.held, strict=True)):
        panel = Panel(
            f"{joint}: {100 * held:.0f} % of the instants held, width {runs.width[j]:.2g} (+-20 %: {runs.usual[j]:.2g})"
        )
        for edge, label in ((runs.low, "95 % of the robots"), (runs.high, "")):
            off = edge[..., j] - runs.q[..., j]
            off[:, 0] = np.nan  # no line from the end of a run to the next
            panel.line(time.ravel(), off.ravel(), "#2ca02c", 1.2, label)
        panel.line(np.array([0.0, LENGTH * count]), np.zeros(2), "#444444", 1.0, "log")
        panels.append(panel)
    units = {robot_model.units(j)[1] for j in range(robot_model.robot.n)}
    return stacked(panels, 1.5, "time of free runs [s]", f"robots - log [{', '.join(sorted(units))}]")


def ranges(ensemble: Ensemble) -> dict[str, Any]:
    """Return mean, sigma and quantiles of the values of joints and bodies, and how these are correlated."""
    robot = ensemble.fit.robot_model.robot
    fields = fields_of(robot, ensemble.standard)
    sizes, times = ensemble.disturbance
    joints: dict[str, Any] = {}
    bodies: dict[str, Any] = {}
    columns: dict[str, Array] = {}
    for j, joint in enumerate(robot.joints):
        own = {name: fields[field][:, j] for name, field in JOINT.items()}
        columns |= {f"{joint}.{name}": x for name, x in own.items()}
        joints[joint] = {name: _told(x) for name, x in own.items()}
        joints[joint]["disturbance"] = {"rms": _short(sizes[j]), "correlation_time": _short(times[j])}
    for k in sorted({int(body) for body in robot.model.jnt_bodyid[: robot.n]}):
        body = robot.model.body(k).name or f"body{k}"
        own = {"mass": fields["body_mass"][:, k]}
        own |= {f"com_{x}": fields["body_ipos"][:, k, i] for i, x in enumerate("xyz")}
        own |= {f"inertia_{i + 1}": fields["body_inertia"][:, k, i] for i in range(3)}
        columns |= {f"{body}.{name}": x for name, x in own.items()}
        bodies[body] = {name: _told(x) for name, x in own.items()}
    varied = {name: x for name, x in columns.items() if np.ptp(x) > 1e-9 * np.abs(x).max(initial=TINY)}
    matrix = np.atleast_2d(np.corrcoef(np.stack(list(varied.values())))) if varied else np.empty((0, 0))
    return {
        "about": (
            f"{DRAWS} physically consistent robots, seed {ensemble.seed}. Units: kg, m, kg m^2, N m, N m s/rad (slides: N, "
            "N s/m); com and principal inertias in the frame of MuJoCo's body; disturbance: torque that the model does not "
            "explain [N m] and the time over which it is alike [s]."
        ),
        "spread": _short(ensemble.spread),
        "free_run": LENGTH,
        "bands": [
            {
                "on": band.title,
                "held": dict(zip(robot.joints, map(_short, band.held), strict=True)),
                "width": dict(zip(robot.joints, map(_short, band.width), strict=True)),
                "width_of_20_percent": dict(zip(robot.joints, map(_short, band.usual), strict=True)),
            }
            for band in ensemble.bands
        ],
        "joints": joints,
        "bodies": bodies,
        "correlations": {"of": list(varied), "matrix": [[round(float(x), 3) for x in row] for row in matrix]},
    }


def _told(x: Array) -> dict[str, float]:
    moments = {"mean": _short(x.mean()), "sigma": _short(x.std())}
    return moments | {name: _short(np.quantile(x, share)) for name, share in QUANTILES.items()}


def _short(x: Any) -> float:
    return float(f"{float(x):.{DIGITS}g}")


def _tables(table: dict[str, Any]) -> str:
    """Return the ranges of values of joints and bodies, as code."""
    texts = []
    for value, part in {**dict.fromkeys(JOINT, "joints"), "mass": "bodies"}.items():
        ends = {name: (own[value]["low"], own[value]["high"]) for name, own in table[part].items()}
        rows = "".join(f"    {name!r}: {low_high},\n" for name, low_high in ends.items())
        texts.append(f"{value.upper()} = {{\n{rows}}}\n")
    return "\n".join(texts)
