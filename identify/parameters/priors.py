"""What holds unidentifiable parameters near those of a given model: distances between bodies."""

from dataclasses import dataclass
from types import ModuleType
from typing import Any, Literal

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.parameters.pseudo_inertia import PSEUDO

Prior = Literal["pullback", "entropic"]
"""Distance to the given model: constant pull-back, tr((S0^-1 dS)^2), or entropic, 2 (tr(S0^-1 S) - ln det(S0^-1 S) - 4), of
each link's pseudo-inertia S. Both are the same near the given model; the entropic one keeps bodies from becoming thin."""

_ROOT2 = np.sqrt(2.0)
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
    """H - G (x, own) lies in the cones, shape (rows, p + own), (rows,)."""
    h: Array
    """H - G (x, own) lies in the cones, shape (rows, p + own), (rows,)."""
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
    linear, rows, limits, cones = np.zeros(p + own), list[Array](), list[Array](), list[Any]()
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
