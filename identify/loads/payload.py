"""Ways to the parameters of a payload.

W. Khalil, M. Gautier and P. Lemoine, "Identification of the payload inertial parameters of industrial manipulators", IEEE ICRA
2007, compare them with two others on a real arm: two fits, subtracted, and the difference of torques, which err more.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import scipy

from idbench.identify.arrays import Array
from idbench.identify.errors import IdentificationError
from idbench.identify.estimators.estimate import Estimate
from idbench.identify.estimators.problem import Problem
from idbench.identify.loads.loaded_robot import LETTERS, LoadedRobot, marked, of_payload
from idbench.identify.models import ExplicitModel
from idbench.identify.parameters.bodies import inertial, pseudo_inertia

MIN_EIGENVALUE = 1e-6  # Least eigenvalue of a body's pseudo-inertia, as a share of the largest


@dataclass(frozen=True, eq=False)
class PayloadEstimate:
    """The parameters of a payload."""

    names: tuple[str, ...]
    """Base parameters: of XXL XYL XZL YYL YZL ZZL MXL MYL MZL ML, in the frame of the link, those that the robot shows."""
    X: Array
    """The estimate, shape (p,)."""
    covariance: Array
    """Of its error, shape (p, p)."""
    known: Mapping[str, float]
    """Parameters that were known."""

    @property
    def sigma(self) -> Array:
        """Standard deviation of every parameter, shape (p,)."""
        return np.sqrt(np.diagonal(self.covariance))

    @property
    def complete(self) -> bool:
        """Whether all ten parameters are known."""
        return {*self.names, *self.known} == set(LETTERS)

    def standard(self) -> Array:
        """Return the ten parameters, shape (10,); raise IdentificationError if the robot does not show all of them."""
        if not self.complete:
            raise IdentificationError(
                f"this robot shows {', '.join(self.names)} of a payload alone: what it leaves open must be known beforehand"
            )
        values = {**dict(zip(self.names, self.X, strict=True)), **self.known}
        return np.array([values[name] for name in LETTERS])

    def consistent(self) -> Array:
        """Return the ten parameters of the body that agrees best with the estimate, in the metric of its covariance.

        Over pseudo-inertias L L', which are physically consistent; what was known stays.
        """
        estimate = self.standard()
        free = [LETTERS.index(name) for name in self.names]
        root = np.linalg.cholesky(self.covariance)
        size = max(abs(estimate[-1]), 1e-6)
        start = _root(pseudo_inertia(estimate), size)
        exact = [LETTERS.index(name) for name in self.known]
        scale = np.maximum(np.abs(estimate), 1e-3 * size)

        def misfit(lower: Array) -> Array:
            x = inertial(_outer(lower))
            sigmas = scipy.linalg.solve_triangular(root, (x - estimate)[free], lower=True)
            return np.concatenate([sigmas, 1e4 * ((x - estimate) / scale)[exact]])

        return inertial(_outer(scipy.optimize.least_squares(misfit, start, x_scale="jac", xtol=1e-12, ftol=1e-12).x))


def together(robot: LoadedRobot) -> PayloadEstimate:
    """Identify robot and payload in one fit of all logs: what the robot is counts for both."""
    found = robot.estimated(robot.of_both, robot.basis)
    return PayloadEstimate(robot.names, *of_payload(found, robot.names), robot.known)


def fixed(robot: LoadedRobot) -> PayloadEstimate:
    """Identify the robot without the payload, then the payload alone, the robot's parameters held."""
    first = robot.estimated(robot.without, robot.robot.basis)
    return with_known_robot(robot, first.names, first.X, first.covariance)


def with_known_robot(robot: LoadedRobot, names: tuple[str, ...], X: Array, covariance: Array) -> PayloadEstimate:
    """Payload by the logs with it, base parameters of the robot being held at an estimate X, shape (p,).

    Their covariance, shape (p, p), is a part of that of the payload.
    """
    basis, logs = robot.basis, marked(robot.loaded, 1.0)
    found = with_robot_held(robot, dict(zip(names, map(float, X), strict=True)))
    of_robot = Problem(logs, basis.of(basis.named(*names)), ExplicitModel(), robot.chain).rows
    G = found.influence()
    slope = np.zeros((len(found.names), len(names))) if G is None else -G.T @ of_robot.W
    X_payload, C = of_payload(found, robot.names)
    place = [found.names.index(name) for name in robot.names]
    return PayloadEstimate(robot.names, X_payload, C + slope[place] @ covariance @ slope[place].T, robot.known)


def with_robot_held(robot: LoadedRobot, values: Mapping[str, float]) -> Estimate:
    """Return the estimate of the payload by the logs with it, the base parameters of the robot held at values, 0 by default."""
    basis = robot.basis
    held = basis.holding(**{name: values.get(name, 0.0) for name in basis.names if name not in robot.names})
    return robot.estimated(marked(robot.loaded, 1.0), held)


WAYS: Mapping[str, Callable[[LoadedRobot], PayloadEstimate]] = {f.__name__: f for f in (together, fixed)}
"""The ways by name, the best first."""


def _outer(lower: Array) -> Array:
    L = np.zeros((4, 4))
    L[np.tril_indices(4)] = lower
    return L @ L.T


def _root(S: Array, size: float) -> Array:
    """Return the lower triangle of the root of a pseudo-inertia, or of one that is near and can exist."""
    values, axes = np.linalg.eigh(S)
    least = max(MIN_EIGENVALUE * values[-1], 1e-9 * size)
    lower = np.linalg.cholesky((axes * np.maximum(values, least)) @ axes.T)
    return np.asarray(lower[np.tril_indices(4)])
