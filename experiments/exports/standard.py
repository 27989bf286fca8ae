"""Standard parameters that make exactly the torques of an estimate."""

from typing import TYPE_CHECKING

import numpy as np

from idbench.experiments.errors import ExperimentError
from idbench.experiments.exports.friction_terms import TERMS
from idbench.experiments.identification.fit import Fit
from idbench.experiments.identification.robot_model import RobotModel
from idbench.identify.basis.parameter import BODY

if TYPE_CHECKING:
    from idbench.identify import Array

KNOWN = ("Ia", "Fv", "Fs", "off", *TERMS, *(letters for _, settings in TERMS.values() for letters in settings.values()))
"""Letters of the laws that a controller's function has, beside the links."""


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
    return dict(zip(grouping.standard.names, map(float, values), strict=True))


def require_known(robot_model: RobotModel, target: object) -> None:
    """Raise ExperimentError if a robot has what a controller's function does not: springs, other laws, coupled drives."""
    strange = [p for p in robot_model.grouping.standard.parameters if p.kind not in BODY and (p.symbol not in KNOWN or p.drive)]
    if strange:
        names = ", ".join(parameter.name for parameter in strange[:6])
        raise ExperimentError(
            f"{target}: the function of a controller has links, rotors, laws of friction and offsets of joints, not {names}: "
            "write the .json, which has all columns, or leave out what makes them (--add, --friction, --coupling, springs)"
        )
