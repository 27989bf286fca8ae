"""Base parameters with their covariance, and all that it takes to compute their columns, as JSON."""

import json
from importlib.metadata import version

import numpy as np

from experiments.identification.fit import Fit
from identify.data.kinematics import INERTIAL

ABOUT = (
    "tau = D(q, qd, qdd) X: X are `parameters`, each the sum of standard parameters in `made_of`. D has the columns of the "
    "standard parameters `column`: those of links from the tree (inertia about the origin of the link's frame and in its axes, "
    "first moments, mass), Ia: qdd of its joint, Fv: qd, Fs: sign(qd), off: 1."
)


def json_text(fit: Fit, model: str) -> str:
    """Return the text: parameters, sigma, covariance, the tree of links, and which columns the regressor has."""
    subject, estimate = fit.subject, fit.estimates[model]
    base, standard = subject.base, subject.grouping.standard.names
    columns = {} if base is None else {n: standard[k] for n, k in zip(base.names, base.kept, strict=True)}
    parameters = [
        {
            "name": p.name,
            "value": float(x),
            "sigma": float(s),
            "unit": p.unit,
            "kind": p.kind,
            "joint": p.joint,
            "column": columns.get(p.name),
            "made_of": _made_of(fit, p.name),
        }
        for p, x, s in zip(fit.basis.parameters, estimate.X, estimate.best_sigma, strict=True)
    ]
    content = {
        "format": "idbench base parameters 1",
        "version": version("idbench"),
        "about": ABOUT if base else "parameters of the paper's closed form of the SCARA (Eq. 5)",
        "robot": subject.tree.name,
        "model": model,
        "estimator": fit.request.estimator,
        "logs": list(fit.logs.names),
        "parameters": parameters,
        "covariance": np.asarray(estimate.best_covariance).tolist(),
        "letters_of_links": list(INERTIAL),
        "gravity": [float(x) for x in subject.tree.gravity],
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
            for joint in subject.tree.joints
        ],
    }
    return json.dumps(content, indent=1, allow_nan=False) + "\n"


def _made_of(fit: Fit, name: str) -> dict[str, float] | None:
    """Return the standard parameters of a base parameter, and their factors."""
    base = fit.subject.base
    if base is None:
        return None
    row = base.K[base.names.index(name)]
    return {base.standard.names[k]: float(row[k]) for k in np.flatnonzero(row)}
