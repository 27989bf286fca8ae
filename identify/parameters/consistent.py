"""Physically consistent standard parameters that agree with an estimate of the base parameters."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from idbench.identify.arrays import Array
from idbench.identify.basis.block import NOT_NEGATIVE
from idbench.identify.data.kinematics import INERTIAL
from idbench.identify.errors import IdentificationError
from idbench.identify.parameters.base_parameters import BaseParameters
from idbench.identify.parameters.bodies import Bodies, nearest

NEAR = 1.0
"""What a step to twice the given model costs [squared sigma]: a prior of that width. A millionth in its place follows what is
noise in the estimate: an arm's link of 1.9 kg, 2.2 in its file, became one of .016. A hundred holds back what is known by 4."""

CONFIDENCE = 0.999  # A model within the ellipsoid that holds the truth with this probability agrees with the estimate

LARGER = 30.0
"""Times the size of the given bodies from which on an estimate says that these stand for bodies of an unknown size."""


@dataclass(frozen=True, eq=False)
class Consistent:
    """Physically consistent standard parameters."""

    names: tuple[str, ...]
    """Of the standard parameters."""
    standard: Array
    """Their values, shape (p,)."""
    given: Array
    """Those that they are near to: of the given model, with bodies of a size where it has none, shape (p,)."""
    base: Array
    """The base values that they give, shape (b,)."""
    departure: Array
    """By how many sigma those differ from the estimate, shape (b,)."""
    distance: float
    """Mahalanobis distance to the estimate of those that constraints touch."""
    touched: int
    """Their number; were the estimate that of a robot of bodies, squares of its distance would be chi^2 of so many degrees of
    freedom."""

    @property
    def agrees(self) -> bool:
        """Whether the estimate's uncertainty explains the distance."""
        return bool(self.distance**2 <= scipy.special.chdtri(max(self.touched, 1), 1 - CONFIDENCE))


def consistent_parameters(
    grouping: BaseParameters, X: Array, covariance: Array, given: Array, *, weight: float = NEAR
) -> Consistent:
    """Return the standard parameters with positive pseudo-inertias that agree best with an estimate.

    They minimise 1/2 (K x - X)' C^-1 (K x - X) + weight d(x, given), d being the log-determinant divergence of `Bodies`: every
    link's pseudo-inertia

        [ tr(I)/2 1 - I    MS ]
        [ MS'              M  ]

    is positive definite (P. M. Wensing, S. Kim and J.-J. Slotine, "Linear matrix inequalities for physically consistent
    inertial parameter identification", IEEE RA-L 3 (2018) 60-67), and armatures and frictions are not negative. So base values
    are the estimate's where it knows them and bodies can have them; what no log shows stays as given, and rotors that the given
    model lacks take what is constant at a joint. What constraints do not touch is not moved; C is then that of the others.

    Parameters
    ----------
    grouping : BaseParameters
        K.
    X : Array, shape (b,)
        The estimate.
    covariance : Array, shape (b, b)
        C.
    given : Array, shape (p,)
        Standard parameters of the given model, consistent themselves.
    weight : float
        What a step to twice the given model costs [squared sigma of the estimate].

    Raises
    ------
    IdentificationError
        If the covariance is not positive definite, or the given model has a link that cannot exist.
    """
    root, filed = _root(covariance), np.array(given, dtype=np.float64)
    given = _sized(grouping, X, covariance, filed)
    # Where bodies were given a size, rotors are no better known than these.
    rotors = np.array([parameter.kind == "rotor inertia" for parameter in grouping.standard.parameters])
    absent = (given == 0) & (np.array_equal(given, filed) | ~rotors)
    rows, columns = _touched(grouping, X)
    standard, alone = given.copy(), np.flatnonzero(~columns)  # as estimated what no constraint touches, as given the others
    which = np.abs(grouping.K[:, alone]).argmax(axis=0)
    standard[alone] = X[which] / grouping.K[which, alone]
    if rows.any():
        K = grouping.K[np.ix_(rows, columns)]
        own, sigma = _root(covariance[np.ix_(rows, rows)]), np.sqrt(np.diagonal(covariance))[rows]
        parameters = [p for p, there in zip(grouping.standard.parameters, columns, strict=True) if there]
        bodies = Bodies(parameters, given[columns], np.maximum(np.abs(given[columns]), least_change(K, sigma)), absent[columns])
        rest = (X - grouping.base(np.where(columns, 0.0, standard)))[rows]
        A = np.asarray(np.linalg.solve(own, np.column_stack([K, rest])), dtype=np.float64)
        standard[columns] = bodies.with_extent(nearest(A[:, :-1], A[:, -1], bodies, weight))
        given[columns] = bodies.given
    base, whole = grouping.base(standard), root @ root.T
    off = (base - X)[rows]
    distance = float(np.linalg.norm(np.linalg.solve(_root(whole[np.ix_(rows, rows)]), off))) if rows.any() else 0.0
    departure = (base - X) / np.sqrt(np.diagonal(whole))
    return Consistent(grouping.standard.names, standard, given, base, departure, distance, int(rows.sum()))


def least_change(K: Array, sigma: Array) -> Array:
    """Return the change of each standard parameter that moves a base value by its sigma, shape (p,); 1 where none does."""
    most = (np.abs(K) / sigma[:, None]).max(axis=0, initial=0.0)
    return np.where(most > 0, 1 / np.where(most > 0, most, 1.0), 1.0)


def _sized(grouping: BaseParameters, X: Array, covariance: Array, given: Array) -> Array:
    """Return the given model, with bodies of the size of the estimate where they are far smaller.

    Robots of a table, or of links without inertias, have bodies of a gram, and the distance to these would be all that counts.
    """
    inertial = np.array([parameter.symbol in INERTIAL for parameter in grouping.standard.parameters])
    bodies, sigma = grouping.K[:, inertial] @ given[inertial], np.sqrt(np.diagonal(covariance))
    # A large rotor that is grouped with bodies says nothing of their size, and neither does one small body among others.
    alone = (bodies != 0) & (grouping.K[:, ~inertial] == 0).all(axis=1)
    ratios = [_ratio(X[rows] / sigma[rows], bodies[rows] / sigma[rows]) for rows in (alone, bodies != 0)]
    return np.where(inertial, given * ratios[0], given) if min(ratios) > LARGER else given.copy()


def _ratio(some: Array, others: Array) -> float:
    size = float(np.linalg.norm(others))
    return float(np.linalg.norm(some)) / size if size > 0 else 0.0


def _touched(grouping: BaseParameters, X: Array) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
    """Masks of base values and standard parameters that constraints touch.

    What is a base value by itself, such as friction, and has a sign that it may have, is not: it stays as it was estimated,
    whatever the bodies do that its estimate is correlated with.
    """
    there = grouping.K != 0
    rows, columns = np.ones(len(X), dtype=bool), np.ones(there.shape[1], dtype=bool)
    for i in np.flatnonzero(there.sum(axis=1) == 1):
        k = int(there[i].argmax())
        alone = there[:, k].sum() == 1 and (parameter := grouping.standard.parameters[k]).symbol not in INERTIAL
        if alone and (parameter.kind not in NOT_NEGATIVE or X[i] / grouping.K[i, k] >= 0):
            rows[i], columns[k] = False, False
    return rows, columns


def _root(covariance: Array) -> Array:
    """Return the triangular L with L L' = C."""
    try:
        variance = np.diagonal(covariance)
        sigma = np.sqrt(np.where(variance > 0, variance, 1.0))
        root: Array = sigma[:, None] * np.linalg.cholesky(covariance / np.outer(sigma, sigma))
    except np.linalg.LinAlgError as error:
        raise IdentificationError(
            "the covariance of the estimate is not positive definite: it does not say what is known"
        ) from error
    return root
