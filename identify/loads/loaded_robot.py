"""Logs of a robot without and with a payload."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.basis.basis import Basis
from idbench.identify.basis.loads import HELD_SHARE, PayloadLink
from idbench.identify.data.kinematics import INERTIAL, KinematicTree
from idbench.identify.data.motion_log import MotionLog
from idbench.identify.errors import LogError, SettingError
from idbench.identify.estimators.estimate import Estimate
from idbench.identify.estimators.estimator import AbstractEstimator
from idbench.identify.estimators.identification import estimate
from idbench.identify.estimators.least_squares.ordinary_weighted_generalized import GeneralizedLeastSquares
from idbench.identify.estimators.problem import Problem
from idbench.identify.estimators.settle import settled
from idbench.identify.models import ExplicitModel
from idbench.identify.parameters.base_parameters import BaseParameters
from idbench.identify.rows.chain import Chain, idbench_chain

LETTERS = tuple(f"{letters}L" for letters in INERTIAL)
"""Names of the parameters of a payload: inertia about the origin of the link's frame, first moments, mass."""


@dataclass(frozen=True, eq=False)
class LoadedRobot:
    """Logs of a robot without and with a payload on its last link, and how they are identified."""

    tree: KinematicTree
    """The robot."""
    standard: Basis
    """Its standard parameters, laws of friction included."""
    without: tuple[MotionLog, ...]
    """Logs without the payload."""
    loaded: tuple[MotionLog, ...]
    """Logs with the payload."""
    chain: Chain = field(default_factory=idbench_chain)
    """Signal processing."""
    estimator: AbstractEstimator = field(default_factory=GeneralizedLeastSquares)
    """Generalized least squares by default."""
    known: Mapping[str, float] = field(default_factory=dict)
    """Parameters of the payload that are known, such as ML, its mass [kg]."""

    def __post_init__(self) -> None:
        if not self.loaded:
            raise LogError("there is no log with the payload")
        if unknown := [name for name in self.known if name not in LETTERS]:
            raise SettingError(f"a payload has no parameter {', '.join(unknown)}; it has {', '.join(LETTERS)}")

    @cached_property
    def robot(self) -> BaseParameters:
        """The base parameters of the robot without the payload."""
        return BaseParameters.of(self.tree, self.standard)

    @cached_property
    def both(self) -> BaseParameters:
        """The base parameters of robot and payload."""
        return BaseParameters.of(self.tree, self.standard + PayloadLink(self.tree, self.tree.n - 1))

    @cached_property
    def payload(self) -> dict[str, Array]:
        """Base parameters of the payload by name: what its ten standard parameters make of each, shape (10,)."""
        both, p = self.both, len(self.standard.names)
        return {name: K[p:] for name, k, K in zip(both.names, both.kept, both.K, strict=True) if k >= p}

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the payload's base parameters that are not known."""
        return tuple(name for name in self.payload if name not in self.known)

    @cached_property
    def basis(self) -> Basis:
        """Robot and payload, what is known of it held."""
        basis = self.both.basis
        if missing := [name for name in self.known if name not in basis.names]:
            raise SettingError(
                f"{', '.join(missing)} of a payload cannot be distinguished from its other parameters on robot "
                f"{self.tree.name!r}: give values of {', '.join(self.names)}"
            )
        return basis.holding(**self.known) if self.known else basis

    @property
    def of_both(self) -> tuple[MotionLog, ...]:
        """All logs, each with whether it has the payload."""
        return (*marked(self.without, 0.0), *marked(self.loaded, 1.0))

    def estimated(self, logs: Sequence[MotionLog], basis: Basis) -> Estimate:
        """Return the estimate of the explicit model."""
        return estimate(settled(Problem(tuple(logs), basis, ExplicitModel(), self.chain)), self.estimator)


def marked(logs: Sequence[MotionLog], share: float) -> tuple[MotionLog, ...]:
    """Return logs that say which share of the payload is held."""
    return tuple(replace(log, conditions={**log.conditions, HELD_SHARE: np.full((1, 1), share)}) for log in logs)


def of_payload(found: Estimate, names: Sequence[str]) -> tuple[Array, Array]:
    """Return the parameters of these names, and their covariance."""
    place = [found.names.index(name) for name in names]
    return found.X[place], found.covariance[np.ix_(place, place)]
