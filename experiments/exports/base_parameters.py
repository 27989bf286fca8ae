"""Base parameters as a file: values, covariance, and what the regressor is made of."""

import json
from importlib.metadata import version
from math import nan

import numpy as np

from idbench.experiments.identification.fit import Fit
from idbench.experiments.results.writing import finite
from idbench.identify.data.kinematics import INERTIAL

ABOUT = (
    "tau = D(q, qd, qdd) X: X are `parameters`, each the sum of standard parameters in `made_of`. D has the columns of the "
    "standard parameters `column`, over `scale`: those of links from the tree (inertia about the origin of the link's frame "
    "and in its axes, first moments, mass), Ia: qdd of its joint, Fv: qd, Fs: sign(qd), off: 1. `torque_interval` has half "
    "widths of 95 % intervals of tau, and the speeds and torques that 99 % of the fit stayed below."
)


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


def interval_of(fit: Fit, model: str) -> dict[str, list[float]]:
    """Return the half widths of the torques' intervals, the fitted speeds and torques, and the band [Hz]; NaN if not known."""
    interval, nothing = fit.torque_intervals[model], [nan] * fit.basis.n
    if interval is None:
        return dict.fromkeys(("half", "speed", "torque"), nothing) | {"band": [nan]}
    return {name: getattr(interval, name).tolist() for name in ("half", "speed", "torque")} | {"band": [interval.band]}
