"""Estimates moved to where bodies can exist."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from idbench.experiments.identification.robot_model import RobotModel
from idbench.identify import Array, Consistent, Estimate, consistent_parameters
from idbench.identify.parameters.bodies import Prior
from idbench.identify.parameters.consistent import NEAR
from idbench.sim.robot.tree import standard_parameters

SURE = 0.1
"""Sigma of what was left out, as a share of the least of the others."""

LITTLE = 0.1
"""Moves of less than this many sigma are not named."""


def consistent_of(robot_model: RobotModel, estimate: Estimate, prior: Prior = "pullback", weight: float = NEAR) -> Consistent:
    """Return the physically consistent standard parameters that agree best with an estimate."""
    given, grouping = standard_parameters(robot_model.robot), robot_model.grouping
    values = np.array([given.get(name, 0.0) for name in grouping.standard.names])
    X, C = _of_all(robot_model, estimate)
    return consistent_parameters(grouping, X, C, values, prior=prior, weight=weight)


def made_consistent(robot_model: RobotModel, estimate: Estimate, prior: Prior) -> Estimate:
    """Return the nearest physically consistent estimate, in the metric of its own covariance.

    Its covariance stays: where the estimate is consistent already nothing moves, and elsewhere it is too large, not too small.
    """
    found = consistent_of(robot_model, estimate, prior)
    X = found.base[_places(robot_model, estimate)]
    return replace(estimate, X=X, solution=None, calibrated=estimate.covariance)


def words_of_consistency(before: dict[str, Estimate], after: dict[str, Estimate]) -> Iterator[str]:
    """Yield by how much estimates were moved, model by model."""
    for model, estimate in after.items():
        sigma = before[model].standard_errors
        moved = np.abs(estimate.X - before[model].X) / np.where(sigma > 0, sigma, 1.0)
        k = int(np.argmax(moved))
        most = f"{estimate.names[k]} most, by {moved[k]:.2g} sigma" if moved[k] >= LITTLE else "nothing by a tenth of a sigma"
        yield f"{model}: moved to where bodies can exist: {most}"


def _places(robot_model: RobotModel, estimate: Estimate) -> list[int]:
    """Return where what was identified stands among all that could be."""
    return [robot_model.grouping.basis.places[parameter] for parameter in estimate.problem.basis.parameters]


def _of_all(robot_model: RobotModel, estimate: Estimate) -> tuple[Array, Array]:
    """Return estimate and covariance with the parameters that were left out: they are zero, and known to be."""
    C = estimate.covariance
    place = _places(robot_model, estimate)
    p = len(robot_model.grouping.names)
    X, sure = np.zeros(p), SURE * np.sqrt(np.diagonal(C).min())
    whole = sure**2 * np.eye(p)
    X[place], whole[np.ix_(place, place)] = estimate.X, C
    return X, whole
