"""The bodies of a robot as a cone: scales of their parameters, a metric of their changes, and what bodies can exist."""

from collections.abc import Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import Any, Literal, final

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.basis.block import NOT_NEGATIVE, Parameter
from idbench.identify.data.kinematics import INERTIAL
from idbench.identify.errors import IdentificationError


def pseudo_inertia(values: Array) -> Array:
    """Return the pseudo-inertia of a link's XX XY XZ YY YZ ZZ MX MY MZ M, shape (4, 4)."""
    xx, xy, xz, yy, yz, zz, *first, mass = values
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    S = np.empty((4, 4))
    S[:3, :3] = np.trace(inertia) / 2 * np.eye(3) - inertia
    S[:3, 3] = S[3, :3] = first
    S[3, 3] = mass
    return S


def inertial(S: Array) -> Array:
    """Return XX XY XZ YY YZ ZZ MX MY MZ M of a pseudo-inertia, shape (10,)."""
    second = S[:3, :3]
    inertia = np.trace(second) * np.eye(3) - second
    return np.array([*inertia[np.triu_indices(3)], *S[:3, 3], S[3, 3]])


PSEUDO = np.array([pseudo_inertia(e) for e in np.eye(len(INERTIAL))])
"""What each inertial parameter adds to a pseudo-inertia, shape (10, 4, 4)."""


Prior = Literal["pullback", "entropic"]
"""Distance to the given model: constant pull-back, tr((S0^-1 dS)^2), or entropic, 2 (tr(S0^-1 S) - ln det(S0^-1 S) - 4), of
each link's pseudo-inertia S. Both are the same near the given model; the entropic one keeps bodies from becoming thin."""

_ROOT2 = np.sqrt(2.0)  # weight of what a symmetric matrix has on both sides
_PLACES = [(i, j) for j in range(4) for i in range(j, 4)]
"""Of the entries of a lower triangular matrix."""


@dataclass(frozen=True, eq=False)
class Terms:
    """What a prior adds to a convex programme over x and variables of its own."""

    own: int
    """Number of variables of its own, which stand behind x."""
    linear: Array
    """Of the objective, shape (p + own,)."""
    G: Array
    """Matrix of the cones: H - G (x, own) lies in them, shape (rows, p + own)."""
    h: Array
    """Their right side, shape (rows,)."""
    cones: list[Any]
    """Of the solver."""


def entropic_terms(links: list[list[int]], inertias: list[Array], p: int, weight: float, clarabel: ModuleType) -> Terms:
    """Return the entropic distance of links to their given pseudo-inertias, as cones.

    ln det P is the largest sum of ln Z_ii with [[P, Z], [Z', diag(Z)]] not negative and Z lower triangular (A. Ben-Tal and
    A. Nemirovski, "Lectures on Modern Convex Optimization", SIAM 2001, section 4.2), P being S in the axes of the given one.

    Parameters
    ----------
    links : list of list of int
        Where the ten inertial parameters of each link stand among the p of x.
    inertias : list of Array, shape (4, 4)
        Pseudo-inertias of the given model.
    p : int
        Number of parameters x.
    weight : float
        What a distance of 1 costs.
    clarabel : module
        The solver.
    """
    each = len(_PLACES) + 4
    own = each * len(links)
    linear = np.zeros(p + own)
    rows = list[Array]()
    limits = list[Array]()
    cones = list[Any]()
    for number, (link, S) in enumerate(zip(links, inertias, strict=True)):
        inverse = np.linalg.inv(np.linalg.cholesky(S))
        units = [inverse @ unit @ inverse.T for unit in PSEUDO]
        first = p + each * number
        linear[link] = [2 * weight * np.trace(unit) for unit in units]
        linear[first + len(_PLACES) : first + each] = -2 * weight
        matrix = np.zeros((8, 8, p + own))
        for place, unit in zip(link, units, strict=True):
            matrix[:4, :4, place] = unit
        for k, (i, j) in enumerate(_PLACES):
            matrix[i, 4 + j, first + k] = matrix[4 + j, i, first + k] = 1.0
            if i == j:
                matrix[4 + i, 4 + i, first + k] = 1.0
        upper = [(i, j) for j in range(8) for i in range(j + 1)]
        rows.append(-np.stack([matrix[i, j] * (1.0 if i == j else _ROOT2) for i, j in upper]))
        limits.append(np.zeros(len(upper)))
        cones.append(clarabel.PSDTriangleConeT(8))
        for i in range(4):
            cone = np.zeros((3, p + own))
            cone[0, first + len(_PLACES) + i], cone[2, first + _PLACES.index((i, i))] = -1.0, -1.0
            rows.append(cone)
            limits.append(np.array([0.0, 1.0, 0.0]))
            cones.append(clarabel.ExponentialConeT())
    return Terms(own, linear, np.concatenate(rows), np.concatenate(limits), cones)


MARGIN = 1e-6
"""Smallest eigenvalue of a link's pseudo-inertia, as a share of the given one: a body with some extent in every direction."""

SOLVED = 1e-7
"""Accuracy of the solver's matrices, as a share of their trace: no eigenvalue is asked to be, or left, below it."""

FLAT = 1e-6
"""Share of the largest eigenvalue below which the least says that a body is flat."""

SMALL, DUST = 1e-3, 1e-6
"""Shares of the robot's mean body below which a given body says nothing of the size of a change, and nothing of the body: a
file may have a flange of a milligram where a tool of a kilogram is; in units of milligrams no estimate could put it there."""


@final
class Bodies:
    """Scales, metric and cones of standard parameters."""

    def __init__(self, parameters: Sequence[Parameter], given: Array) -> None:
        self._p, self.given = len(parameters), given
        links = sorted({p.joint for p in parameters if p.kind == "mass" and p.joint is not None})
        place = {(p.symbol, p.joint): i for i, p in enumerate(parameters)}
        self.links = [[place[x, joint] for x in INERTIAL] for joint in links]
        self._signed = [i for i, parameter in enumerate(parameters) if parameter.kind in NOT_NEGATIVE]
        thick = [_thick(pseudo_inertia(given[link]), j + 1) for j, link in zip(links, self.links, strict=True)]
        mean = _mean(thick)
        self.inertias = [_at_least(S, DUST * mean) for S in thick]
        self._sizes = [_at_least(S, SMALL * mean) for S in thick]
        self.scale, self.metric = np.where(given == 0, 1.0, np.abs(given)), np.eye(self._p)
        for S, link in zip(self._sizes, self.links, strict=True):
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
        for S_given, S_size, link in zip(self.inertias, self._sizes, self.links, strict=True):
            weights = np.array([[S[i, j] * (1.0 if i == j else _ROOT2) for S in PSEUDO] for i, j in lower])
            block = np.zeros((len(lower), self._p))
            size = np.trace(S_size)  # a gram of a wrist and a ton of a base are solved to the same share
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
            f"link {number} of the given model is not physically consistent: its pseudo-inertia is not positive (is the centre "
            "of mass outside of the body that the inertia describes?); correct the file first"
        )
    return S + FLAT * largest * np.eye(4) if lowest < FLAT * largest else S


def _mean(inertias: Sequence[Array]) -> Array:
    """Return the pseudo-inertia of a ball of the bodies' mean mass whose second moments are theirs on average."""
    if not inertias:
        return np.eye(4)
    mass = float(np.mean([S[3, 3] for S in inertias]))
    moment = float(np.mean([np.trace(S[:3, :3]) for S in inertias])) / 3
    return np.diag([moment, moment, moment, mass])


def _at_least(S: Array, least: Array) -> Array:
    """Return a pseudo-inertia that is nowhere less than another: what is, in the axes that both share, is raised to it."""
    root = np.sqrt(np.diagonal(least))
    values, axes = np.linalg.eigh(S / np.outer(root, root))
    return S if values[0] >= 1 else (axes * np.maximum(values, 1.0)) @ axes.T * np.outer(root, root)


def _spread(S: Array) -> Array:
    """Return what counts as a large change of each of a link's parameters: geometric means of the diagonal of S."""
    root = np.sqrt(np.diagonal(S))
    return np.array([np.max(np.abs(P) * np.outer(root, root)) for P in PSEUDO])
