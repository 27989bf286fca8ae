"""The physically consistent parameters nearest to an estimate."""

import numpy as np

from idbench.experiments.identification.robot_model import RobotModel
from idbench.identify import Array, Consistent, Estimate, consistent_parameters
from idbench.identify.parameters.consistent import NEAR
from idbench.sim.robot.tree import standard_parameters

SURE = 0.1
"""Sigma of what was left out, as a share of the least of the others."""


def consistent_of(robot_model: RobotModel, estimate: Estimate, weight: float = NEAR) -> Consistent:
    """Return the physically consistent standard parameters that agree best with an estimate."""
    given, grouping = standard_parameters(robot_model.robot), robot_model.grouping
    values = np.array([given.get(name, 0.0) for name in grouping.standard.names])
    X, C = _of_all(robot_model, estimate)
    return consistent_parameters(grouping, X, C, values, weight=weight)


def _places(robot_model: RobotModel, estimate: Estimate) -> list[int]:
    """Return where what was identified stands among all that could be."""
    return [robot_model.grouping.basis.places[parameter] for parameter in estimate.problem.basis.parameters]


def _of_all(robot_model: RobotModel, estimate: Estimate) -> tuple[Array, Array]:
    """Return estimate and covariance with the parameters that were left out: they are zero, and known to be."""
    C = estimate.within_covariance  # the scatter between logs is not known of combinations
    place = _places(robot_model, estimate)
    p = len(robot_model.grouping.names)
    X, sure = np.zeros(p), SURE * np.sqrt(np.diagonal(C).min())
    whole = sure**2 * np.eye(p)
    X[place], whole[np.ix_(place, place)] = estimate.X, C
    return X, whole
