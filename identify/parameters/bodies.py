"""The bodies of a robot as a cone: scales of their parameters, a metric of their changes, and what bodies can exist."""

from collections.abc import Sequence
from typing import final

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.basis.parameter import NOT_NEGATIVE, Parameter
from idbench.identify.data.kinematics import INERTIAL
from idbench.identify.errors import IdentificationError
from idbench.identify.parameters.pseudo_inertia import PSEUDO, inertial, pseudo_inertia

MARGIN = 1e-6
"""Smallest eigenvalue of a link's pseudo-inertia, as a share of the given one: a body with some extent in every direction."""

SOLVED = 1e-7
"""Accuracy of the solver's matrices, as a share of their trace: no eigenvalue is asked to be, or left, below it."""

FLAT = 1e-6
"""Share of the largest eigenvalue below which the least says that a body is flat."""

SMALL, DUST = 1e-3, 1e-6
"""Shares of the robot's mean body below which a given body says nothing of the size of a change, and nothing of the body: a
file may have a flange of a milligram where a tool of a kilogram is; in units of milligrams no estimate could put it there."""

_ROOT2 = np.sqrt(2.0)


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
