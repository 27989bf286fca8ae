"""The physically consistent parameters nearest to an estimate."""

from dataclasses import replace

import numpy as np

from idbench.experiments.identification.robot_model import RobotModel
from idbench.identify import Array, Consistent, Estimate, consistent_parameters
from idbench.identify.arrays import TINY
from idbench.identify.basis.block import BODY
from idbench.identify.parameters.bodies import exist
from idbench.identify.parameters.consistent import least_change
from idbench.identify.telling import stage

SURE = 0.1  # Sigma of what was left out, as a share of the least of the others


def consistent_of(robot_model: RobotModel, estimate: Estimate, near: Array | None = None) -> Consistent:
    """Return the physically consistent standard parameters that agree best with an estimate, near the file's, or others."""
    X, C = _of_all(robot_model, estimate)
    return consistent_parameters(robot_model.grouping, X, C, robot_model.filed if near is None else near)


def drawn_about(robot_model: RobotModel, estimate: Estimate, deviations: Array) -> Array:
    """Return consistent standard parameters about those of an estimate, deviations of X being given, shape (draw, p) each.

    They move as little as they can, as shares of themselves: so what no deviation moves stays, and only a robot that could not
    exist is made consistent by itself.
    """
    grouping, middle = robot_model.grouping, consistent_of(robot_model, estimate).standard
    place, K = _places(robot_model, estimate), grouping.K[_places(robot_model, estimate)]
    sigma = np.sqrt(np.maximum(np.diagonal(estimate.covariance), TINY))
    size = np.maximum(np.abs(middle), least_change(K, sigma))
    moved = np.zeros((len(deviations), len(grouping.names)))
    moved[:, place] = deviations
    back = size[:, None] * np.linalg.pinv(grouping.K * size)
    found = middle + np.matmul(back, moved[..., None])[..., 0]
    for k, own in enumerate(found):
        if not exist(grouping.standard.parameters, own):
            with stage(f"robot {k + 1} of {len(found)}"):
                off = replace(estimate, X=estimate.X + deviations[k])
                found[k] = consistent_of(robot_model, off, middle).standard
    return found


def _places(robot_model: RobotModel, estimate: Estimate) -> list[int]:
    """Places of the identified parameters among all standard ones."""
    return [robot_model.grouping.basis.places[parameter] for parameter in estimate.problem.basis.parameters]


def _of_all(robot_model: RobotModel, estimate: Estimate) -> tuple[Array, Array]:
    """Return estimate and covariance with those that were left out: known to be zero; in poses, bodies' as in the file."""
    C = estimate.within_covariance  # the scatter between logs is not known of combinations
    place = _places(robot_model, estimate)
    sure = SURE * np.sqrt(np.diagonal(C).min())
    poses = estimate.problem.logs[0].poses
    bodies = np.array([poses and parameter.kind in BODY for parameter in robot_model.grouping.parameters])
    X = np.where(bodies, robot_model.grouping.base(robot_model.filed), 0.0)
    whole = np.diag(np.where(bodies, np.abs(X) + sure, sure) ** 2)
    X[place], whole[np.ix_(place, place)] = estimate.X, C
    return X, whole
