"""Physically consistent standard parameters that agree with an estimate of the base parameters."""

from collections.abc import Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import Any, final

import numpy as np
import scipy

from identify.arrays import Array
from identify.basis.parameter import NOT_NEGATIVE, Parameter
from identify.data.kinematics import INERTIAL
from identify.errors import IdentificationError
from identify.parameters.base_parameters import BaseParameters
from identify.parameters.priors import Prior, entropic_terms
from identify.parameters.pseudo_inertia import PSEUDO, inertial, pseudo_inertia

NEAR = 1e-4
"""What a step to twice the given model costs, beside one sigma of the estimate: nothing, where the estimate knows anything."""

MARGIN = 1e-6
"""Smallest eigenvalue of a link's pseudo-inertia, as a share of the given one: a body with some extent in every direction."""

SOLVED = 1e-7
"""Accuracy of the solver's matrices, as a share of their trace: no eigenvalue is asked to be, or left, below it."""

FLAT = 1e-6
"""Share of the largest eigenvalue below which the least says that a body is flat."""

CONFIDENCE = 0.999
"""A model within the ellipsoid that holds the truth with this probability agrees with the estimate."""

_ROOT2 = np.sqrt(2.0)


@final
@dataclass(frozen=True, eq=False)
class Consistent:
    """Standard parameters of bodies that can exist.

    Parameters
    ----------
    names : tuple of str
        Of the standard parameters.
    standard : Array, shape (p,)
        Their values.
    base : Array, shape (b,)
        The base values that they give.
    departure : Array, shape (b,)
        By how many sigma those differ from the estimate.
    distance : float
        Mahalanobis distance to the estimate: its squares would be distributed as chi^2 with b degrees of freedom.
    """

    names: tuple[str, ...]
    standard: Array
    base: Array
    departure: Array
    distance: float

    @property
    def agrees(self) -> bool:
        """Whether the estimate's uncertainty explains the distance."""
        return bool(self.distance**2 <= scipy.stats.chi2.ppf(CONFIDENCE, len(self.base)))


def consistent_parameters(
    grouping: BaseParameters,
    X: Array,
    covariance: Array,
    given: Array,
    *,
    prior: Prior = "pullback",
    weight: float = NEAR,
) -> Consistent:
    """Return the standard parameters with positive pseudo-inertias that agree best with an estimate.

    They minimise (K x - X)' C^-1 (K x - X) + weight d(x, given) over all x for which every link's pseudo-inertia

        [ tr(I)/2 1 - I    MS ]
        [ MS'              M  ]

    is positive definite (P. M. Wensing, S. Kim and J.-J. Slotine, "Linear matrix inequalities for physically consistent
    inertial parameter identification", IEEE RA-L 3 (2018) 60-67), and armatures and frictions are not negative. d, the
    distance to the given model, depends on no frame (`Prior`: T. Lee, P. M. Wensing and F. C. Park, "Geometric robot dynamic
    identification: a convex programming approach", IEEE T-RO 36 (2020) 348-365). So base values are the estimate's where
    bodies can have them, and what no motion shows stays as it was given.

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
    prior : {"pullback", "entropic"}
        d of the links; of armatures and frictions it is the square of their relative change.
    weight : float
        What a step to twice the given model costs [squared sigma of the estimate].

    Raises
    ------
    IdentificationError
        If Clarabel is not installed, the covariance is not positive definite, the given model has a link that cannot exist, or
        the solver fails.
    """
    clarabel = _solver()
    names = grouping.standard.names
    problem = _Problem(grouping.standard.parameters, np.asarray(given, dtype=np.float64))
    root = _root(covariance)
    # x = start + J u + N z: u counts sigma away from the estimate, z is what no motion shows.
    start = grouping.nearest(X, problem.given, problem.scale)
    J = problem.scale[:, None] * np.linalg.pinv(grouping.K * problem.scale) @ root
    N = problem.scale[:, None] * scipy.linalg.null_space(grouping.K * problem.scale)
    T = np.concatenate([J, N], axis=1)
    x = _solved(clarabel, problem, (start, T, len(X)), prior, weight)
    standard = problem.projected(start + T @ x)
    base = grouping.base(standard)
    distance = float(np.linalg.norm(np.linalg.solve(root, base - X)))
    return Consistent(names, standard, base, (base - X) / np.sqrt(np.diagonal(covariance)), distance)


def _solved(clarabel: ModuleType, problem: "_Problem", way: tuple[Array, Array, int], prior: Prior, weight: float) -> Array:
    """Return v of x = start + T v with the least sum of the squares of its first b and of weight d(x, given).

    `way` is start, T and b.
    """
    start, T, b = way
    steps, away = T / problem.scale[:, None], (start - problem.given) / problem.scale
    metric = problem.metric if prior == "pullback" else problem.metric_of_drives
    quadratic = weight * steps.T @ metric @ steps + np.diag(np.r_[np.ones(b), np.zeros(T.shape[1] - b)])
    linear = 2 * weight * steps.T @ metric @ away
    G, h, (signs, links) = problem.cones()
    cones = [clarabel.NonnegativeConeT(signs), *(clarabel.PSDTriangleConeT(4) for _ in range(links))]
    G, h = G @ T, h - G @ start
    if prior == "entropic":
        terms = entropic_terms(problem.links, problem.inertias, len(start), weight, clarabel)
        x_of = scipy.linalg.block_diag(T, np.eye(terms.own))
        linear = np.r_[linear, np.zeros(terms.own)] + terms.linear @ x_of
        G = np.concatenate([np.pad(G, ((0, 0), (0, terms.own))), terms.G @ x_of])
        h, cones = np.r_[h, terms.h - terms.G[:, : len(start)] @ start], [*cones, *terms.cones]
        quadratic = np.pad(quadratic, (0, terms.own))
    found = clarabel.DefaultSolver(
        scipy.sparse.csc_matrix(np.triu(2 * quadratic)), linear, scipy.sparse.csc_matrix(G), h, cones, _quiet(clarabel)
    ).solve()
    if str(found.status) not in ("Solved", "AlmostSolved"):
        raise IdentificationError(
            f"bodies that can exist come nowhere near these parameters (the solver ends with {found.status}): is the torque's "
            "sign, unit and delay right?"
        )
    return np.array(found.x)[: T.shape[1]]


class _Problem:
    """Scales, metric and cones of standard parameters."""

    def __init__(self, parameters: Sequence[Parameter], given: Array) -> None:
        self._p, self.given = len(parameters), given
        links = sorted({p.joint for p in parameters if p.kind == "mass" and p.joint is not None})
        place = {(p.symbol, p.joint): i for i, p in enumerate(parameters)}
        self.links = [[place[x, joint] for x in INERTIAL] for joint in links]
        self._signed = [i for i, parameter in enumerate(parameters) if parameter.kind in NOT_NEGATIVE]
        self.inertias = [_thick(pseudo_inertia(given[link]), j + 1) for j, link in zip(links, self.links, strict=True)]
        self.scale, self.metric = np.where(given == 0, 1.0, np.abs(given)), np.eye(self._p)
        for S, link in zip(self.inertias, self.links, strict=True):
            self.scale[link] = _spread(S)
            steps = [np.linalg.solve(S, PSEUDO[k] * self.scale[i]) for k, i in enumerate(link)]
            self.metric[np.ix_(link, link)] = [[np.trace(a @ b) for b in steps] for a in steps]

    @property
    def metric_of_drives(self) -> Array:
        """The metric of what is no inertia of a link."""
        metric = self.metric.copy()
        for link in self.links:
            metric[np.ix_(link, link)] = 0.0
        return metric

    def cones(self) -> tuple[Array, Array, tuple[int, int]]:
        """Return G, h of h - G x in the cones, and the numbers of signs and of matrices among them."""
        rows = [-np.eye(self._p)[self._signed]]
        limits = [np.zeros(len(self._signed))]
        lower = [(i, j) for j in range(4) for i in range(j + 1)]  # of the upper triangle, column by column
        for S_given, link in zip(self.inertias, self.links, strict=True):
            weights = np.array([[S[i, j] * (1.0 if i == j else _ROOT2) for S in PSEUDO] for i, j in lower])
            block = np.zeros((len(lower), self._p))
            size = np.trace(S_given)  # a gram of a wrist and a ton of a base are solved to the same share
            block[:, link] = -weights / size
            rows.append(block)
            smallest = max(MARGIN * np.linalg.eigvalsh(S_given)[0] / size, SOLVED)
            limits.append(np.array([-smallest if i == j else 0.0 for i, j in lower]))
        return np.concatenate(rows), np.concatenate(limits), (len(self._signed), len(self.links))

    def projected(self, standard: Array) -> Array:
        """Return parameters whose cones are kept exactly: what the solver leaves outside is moved to their edge."""
        inside = standard.copy()
        inside[self._signed] = np.maximum(inside[self._signed], 0.0)
        for link in self.links:
            S = pseudo_inertia(inside[link])
            values, axes = np.linalg.eigh(S)
            least = SOLVED / 2 * np.trace(S)
            if values[0] < least:
                inside[link] = inertial((axes * np.maximum(values, least)) @ axes.T)
        return inside


def _thick(S: Array, number: int) -> Array:
    """Return the pseudo-inertia of a link, that of a plate or a rod with some thickness; raise if there is no such body."""
    lowest, largest = np.linalg.eigvalsh(S)[[0, -1]]
    if lowest < -FLAT * largest or largest <= 0:
        raise IdentificationError(
            f"link {number} of the given model cannot exist: its pseudo-inertia is not positive (is the centre of mass "
            "outside of the body that the inertia describes?); correct the file first"
        )
    return S + FLAT * largest * np.eye(4) if lowest < FLAT * largest else S


def _spread(S: Array) -> Array:
    """Return what counts as a large change of each of a link's parameters: geometric means of the diagonal of S."""
    root = np.sqrt(np.diagonal(S))
    return np.array([np.max(np.abs(P) * np.outer(root, root)) for P in PSEUDO])


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


def _quiet(clarabel: ModuleType) -> Any:
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    return settings


def _solver() -> ModuleType:
    try:
        import clarabel
    except ImportError as error:
        raise IdentificationError(
            "physically consistent parameters need the solver Clarabel: uv run --extra consistent ..., or pip install clarabel"
        ) from error
    return clarabel
