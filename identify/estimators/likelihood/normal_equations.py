"""The normal equations of a motion, the robot's parameters and the delay of its torques together."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from identify.arrays import Array
from identify.basis.basis import Basis
from identify.errors import IdentificationError
from identify.estimators.likelihood.cells import GAUSS, Cells, hermite
from identify.estimators.likelihood.reversals import Inside, Turns, signed
from identify.noise.linearization import observation, slopes

Solved = tuple[Array, Array, Array]
"""L^-1 A_zX, L^-1 b_nodes, and the factor L of A_zz in bands."""

CHUNK = 2000
"""Cells whose columns are made at once: those of all would take too much memory."""

RATE = 50.0
"""Frequency [Hz] at which the torques' slopes are computed; between they are interpolated."""


@dataclass(frozen=True, eq=False)
class Noise:
    """Standard deviations of what a log's cells say, shape (joint, cell) where they vary.

    Parameters
    ----------
    mean, half : Array, shape (joint, cell)
        Of the mean torque, and of half the difference of both Gauss points [N m].
    position : Array, shape (joint,)
        Of the positions [rad].
    known : bool array, shape (joint, cell)
        Where the sign of friction is known.
    velocity, wanted : Array, shape (node, joint)
        Of the velocities that differences of the positions give, infinite where torques say more, and these velocities
        [rad/s].
    turns : Turns
        Reversals inside the cells, and which cells have a level of their own beside them.
    """

    mean: Array
    half: Array
    position: Array
    known: npt.NDArray[np.bool_]
    velocity: Array
    wanted: Array
    turns: Turns


@dataclass(eq=False)
class NormalEquations:
    """A [dz; dX] = b, with A block-tridiagonal in the nodes and bordered by the parameters.

    Parameters
    ----------
    band : Array, shape (4 n, 2 n nodes)
        A_zz, its lower half as `scipy.linalg.cholesky_banded` has it.
    border : Array, shape (2 n nodes, p + 1)
        A_zX; the last column is that of the delay, as which positions lie elsewhere in their cells.
    corner : Array, shape (p + 1, p + 1)
        A_XX.
    b_nodes, b_parameters : Array, shape (2 n nodes, 1 + m), (p + 1, 1 + m)
        The right-hand side, and m of `signs`.
    squares : Array, shape (2, joint)
        Sums of the squared residuals of the mean torques over their variances: where joints move on, and near reversals.
    cost : float
        Sum of the squared residuals over their variances.
    """

    band: Array
    border: Array
    corner: Array
    b_nodes: Array
    b_parameters: Array
    squares: Array
    cost: float = 0.0

    @classmethod
    def of(cls, cells: Cells, basis: Basis, X: Array, z: Array, noise: Noise, signs: Array | None = None) -> "NormalEquations":
        """Return those of a log at the parameters X and the motion z, shape (node, 2, joint).

        With random `signs`, shape (k, joint, cell), also right-hand sides of residuals that are one of them, for each joint:
        their products with the solutions show how much of the mean torques' residuals the unknowns take (M. F. Hutchinson,
        "A stochastic estimator of the trace of the influence matrix", Communications in Statistics 19 (1990) 433-450).
        """
        n, p, size = basis.n, len(X) + 1, z.size
        right = 1 + (0 if signs is None else len(signs) * 2 * n)
        zeros = np.zeros((4 * n, size)), np.zeros((size, p)), np.zeros((p, p)), np.zeros((size, right)), np.zeros((p, right))
        found = cls(*zeros, np.zeros((2, n)))
        found._add_positions(cells, z, noise.position)
        found._add_velocities(z, noise)
        inside = noise.turns.at(z)
        for part in _chunks(cells.count):
            found._add_torques(cells, basis, X, z, noise, part, signs, inside)
        return found

    def solved(self) -> Solved:
        """Return the motion eliminated.

        Raises
        ------
        IdentificationError
            If positions and torques do not determine the motion.
        """
        both, p = np.concatenate([self.border, self.b_nodes], axis=1), self.border.shape[1]
        L, singular = scipy.linalg.lapack.dpbtrf(self.band, lower=True, overwrite_ab=True)
        z, none = scipy.linalg.lapack.dtbtrs(L, both, uplo="L", overwrite_b=True)
        if singular or none:
            raise IdentificationError(
                "the motion is not determined by this log: a joint stands, or its torque is constant or another's: take GLS"
            )
        return z[:, :p], z[:, p:], L

    def _add_positions(self, cells: Cells, z: Array, sigma: Array) -> None:
        cell, place = cells.places
        n, w = len(sigma), hermite(place, cells.period)[0]
        ends = np.stack([z[cell, 0], z[cell, 1], z[cell + 1, 0], z[cell + 1, 1]])
        left = (cells.log.q[cells.inside] - np.einsum("ks,ksj->sj", w, ends)) / sigma**2
        self.cost += float(np.sum((left * sigma) ** 2))
        speed = np.einsum("ks,ksj->sj", hermite(place, cells.period)[1], ends)
        self.corner[-1, -1] += float(np.sum((speed / sigma) ** 2))
        self.b_parameters[-1, 0] -= float(np.sum(speed * left))
        where = [2 * n * cell[:, None] + n * k + np.arange(n) for k in range(4)]
        for k in range(4):
            np.add.at(self.b_nodes[:, 0], where[k], w[k][:, None] * left)
            np.add.at(self.border[:, -1], where[k], -w[k][:, None] * speed / sigma**2)
            for m in range(k + 1):
                np.add.at(self.band, (np.full_like(where[m], n * (k - m)), where[m]), (w[k] * w[m])[:, None] / sigma**2)

    def _add_velocities(self, z: Array, noise: Noise) -> None:
        weight, left = noise.velocity**-2, noise.wanted - z[:, 1]
        self.cost += float(np.sum(weight * left**2))
        n = z.shape[-1]
        rows = (2 * n * np.arange(len(z))[:, None] + n + np.arange(n)).ravel()
        self.band[0, rows] += weight.ravel()
        self.b_nodes[rows, 0] += (weight * left).ravel()

    def _add_torques(
        self, cells: Cells, basis: Basis, X: Array, z: Array, noise: Noise, part: slice, signs: Array | None, inside: Inside
    ) -> None:
        nodes = z[part.start : part.stop + 1]
        points = [(q, signed(qd, inside.sign[:, part]), qdd) for q, qd, qdd in (cells.motion(nodes, s) for s in GAUSS)]
        D = np.stack([observation(basis, *point) for point in points])  # (point, cell, joint, p)
        both, T = _slopes_of(cells, basis, X, nodes), cells.period
        J = np.stack([_by_nodes(slope, hermite(s, T)) for s, slope in zip(GAUSS, both, strict=True)])
        jumps = inside.jumps(basis, points, D, part)
        wanted, groups = [tau[:, part].T for tau in cells.torque], (noise.known, noise.turns.near)
        for sign, tau, sigma in ((1.0, wanted[0], noise.mean), (-1.0, wanted[1], noise.half)):
            # Mean of both points, and half of what the second has more than the first.
            scale = 1 / sigma[:, part].T
            W, H = ((x[1] + sign * x[0]) / 2 for x in (D, J))
            jumps.add(W, H, X, sign)
            W, H = W * scale[..., None], H * scale[..., None]
            rho = (tau * scale - np.matmul(W, X))[..., None]
            self.cost += float(np.sum(rho**2))
            if sign > 0:
                self.squares += [np.sum(rho[..., 0] ** 2 * group[:, part].T, axis=0) for group in groups]
            if signs is not None:
                others = np.zeros((*rho.shape[:2], 2 * rho.shape[1], len(signs)))
                for g, group in enumerate(groups):
                    for j in range(basis.n * (sign > 0)):
                        others[:, j, g * basis.n + j] = signs[:, j, part].T * group[j, part, None]
                rho = np.concatenate([rho, others.reshape(*rho.shape[:2], -1)], axis=-1)
            self._add_cells(part.start, np.swapaxes(H, -1, -2), W, rho)

    def _add_cells(self, first: int, H: Array, W: Array, rho: Array) -> None:
        """Add residuals rho, (cell, joint, right), of slopes H, (cell, 4 n, joint), by nodes and W, (cell, joint, p), by X."""
        count, width = H.shape[:2]
        own, step = np.matmul(H, np.swapaxes(H, -1, -2)), width // 2
        stop = step * (count - 1) + 1
        for i in range(width):
            for j in range(i + 1):
                at = step * first + j
                self.band[i - j, at : at + stop : step] += own[:, i, j]
        crossed, right = np.matmul(H, W), np.matmul(H, rho)
        for half in (0, 1):
            begin = step * (first + half)
            rows = slice(begin, begin + step * count)
            self.border[rows, :-1] += crossed[:, half * step : (half + 1) * step].reshape(step * count, -1)
            self.b_nodes[rows] += right[:, half * step : (half + 1) * step].reshape(step * count, -1)
        flat = W.reshape(-1, W.shape[-1])
        self.corner[:-1, :-1] += flat.T @ flat
        self.b_parameters[:-1] += flat.T @ rho.reshape(len(flat), -1)


def _chunks(count: int) -> Iterator[slice]:
    for start in range(0, count, CHUNK):
        yield slice(start, min(start + CHUNK, count))


def _slopes_of(cells: Cells, basis: Basis, X: Array, z: Array) -> list[list[Array]]:
    """Return stiffness, damping and inertia at both Gauss points of every cell, shape (cell, joint, joint) each.

    Inertia at one point less that at the other counts: accelerations that a node makes there have opposite signs.
    """
    count, step = len(z) - 1, max(1, int(cells.log.fs / RATE))
    some = np.unique(np.append(np.arange(0, count, step), count - 1))
    q, qd, qdd = (x[..., some] for x in cells.motion(z, 0.5))
    found = slopes(basis, X, q, qd, qdd, qd)
    if len(some) < 2:
        return [[np.moveaxis(x, -1, 0) for x in reversed(found)]] * 2
    return [[_between(x, some, np.arange(count) + s - 0.5) for x in reversed(found)] for s in GAUSS]


def _between(x: Array, some: npt.NDArray[np.intp], at: Array) -> Array:
    """Return values x, shape (..., len(some)), of cells `some` at places `at`, time first, by straight lines."""
    low = np.clip(np.searchsorted(some, at, side="right") - 1, 0, len(some) - 2)
    share = (at - some[low]) / (some[low + 1] - some[low])
    return np.moveaxis(x[..., low] * (1 - share) + x[..., low + 1] * share, -1, 0)


def _by_nodes(slope: list[Array], weights: tuple[Array, Array, Array]) -> Array:
    """Return slopes of the torques by (q0, qd0, q1, qd1) of all joints, shape (cell, joint, 4 n)."""
    total = sum(s[:, :, None, :] * w[:, None] for s, w in zip(slope, weights, strict=True))
    return np.asarray(total).reshape(*slope[0].shape[:2], -1)
