"""The normal equations of a motion, the robot's parameters and the delay of its torques together."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from idbench.identify.arrays import Array
from idbench.identify.basis.basis import Basis
from idbench.identify.errors import IdentificationError
from idbench.identify.estimators.likelihood.cells import GAUSS, Cells, hermite
from idbench.identify.estimators.likelihood.reversals import Inside, Jumps, Turns, signed
from idbench.identify.noise.band_matrix import solve_lower
from idbench.identify.noise.linearization import observation, slopes

Solved = tuple[Array, Array, Array]
"""L^-1 A_zX, L^-1 b_nodes, and the factor L of A_zz in bands."""

CHUNK = 4000  # Cells whose columns are made at once: those of all would take too much memory
RATE = 50.0  # Frequency [Hz] at which the torques' slopes are computed; between they are interpolated


@dataclass(frozen=True, eq=False)
class Noise:
    """Standard deviations of what a log's cells say, shape (joint, cell) where they vary."""

    mean: Array
    """Level of the mean torque of both Gauss points [N m], shape (joint, cell)."""
    half: Array
    """Level of half the difference of both Gauss points [N m], shape (joint, cell)."""
    position: Array
    """Of the positions [rad], shape (joint,)."""
    known: npt.NDArray[np.bool_]
    """Where the sign of friction is known, shape (joint, cell)."""
    velocity: Array
    """Level of the velocities that differences of the positions give [rad/s], infinite where torques say more, shape (node,
    joint)."""
    wanted: Array
    """These velocities [rad/s], shape (node, joint)."""
    turns: Turns
    """Reversals inside the cells, and which cells have a level of their own beside them."""


@dataclass(eq=False)
class NormalEquations:
    """A [dz; dX] = b, with A block-tridiagonal in the nodes and bordered by the parameters."""

    band: Array
    """A_zz, its lower half as `scipy.linalg.cholesky_banded` has it, shape (4 n, 2 n nodes)."""
    both: Array
    """A_zX, whose last column is that of the delay, as which positions lie elsewhere in their cells; and the right-hand sides,
    shape (2 n nodes, p + 2 + m)."""
    corner: Array
    """A_XX, shape (p + 1, p + 1)."""
    b_parameters: Array
    """The right-hand side, and m of `signs`, shape (p + 1, 1 + m)."""
    cost: float = 0.0
    """Sum of the squared residuals over their variances."""

    @classmethod
    def of(cls, cells: Cells, basis: Basis, X: Array, z: Array, noise: Noise, signs: Array | None = None) -> "NormalEquations":
        """Return those of a log at the parameters X and the motion z, shape (node, 2, joint).

        With random `signs`, shape (k, joint, cell), also right-hand sides of residuals that are one of them, for each joint:
        their products with the solutions show how much of the mean torques' residuals the unknowns take (M. F. Hutchinson,
        "A stochastic estimator of the trace of the influence matrix", Communications in Statistics 19 (1990) 433-450).
        """
        n = basis.n
        p = len(X) + 1
        size = z.size
        right = 1 + (0 if signs is None else len(signs) * 2 * n)
        both = np.zeros((size, p + right))
        found = cls(np.zeros((size, 4 * n)).T, both, np.zeros((p, p)), np.zeros((p, right)))
        found._add_positions(cells, z, noise.position)
        found._add_velocities(z, noise)
        for part in _chunks(cells.count):
            found._add_torques(cells, basis, X, z, noise, part, signs)
        return found

    @property
    def b_nodes(self) -> Array:
        """The right-hand sides of the nodes."""
        return self.both[:, len(self.corner) :]

    def solved(self) -> Solved:
        """Return the motion eliminated.

        Raises
        ------
        IdentificationError
            If positions and torques do not determine the motion.
        """
        both, p = self.both, len(self.corner)
        L, singular = scipy.linalg.lapack.dpbtrf(self.band, lower=True, overwrite_ab=True)
        if not singular:
            solve_lower(L, both)
        if singular or not np.isfinite(both).all():
            raise IdentificationError(
                "the motion is not determined by this log: a joint is at rest, or its torque is constant or another's: use GLS"
            )
        return both[:, :p], both[:, p:], L

    def _add_positions(self, cells: Cells, z: Array, sigma: Array) -> None:
        cell, place = cells.places
        n, w = len(sigma), hermite(place, cells.period)[0]
        ends = np.stack([z[cell, 0], z[cell, 1], z[cell + 1, 0], z[cell + 1, 1]])
        left = (cells.log.q[cells.inside] - np.einsum("ks,ksj->sj", w, ends)) / sigma**2
        self.cost += float(np.sum((left * sigma) ** 2))
        speed = np.einsum("ks,ksj->sj", hermite(place, cells.period)[1], ends)
        self.corner[-1, -1] += float(np.sum((speed / sigma) ** 2))
        self.b_parameters[-1, 0] -= float(np.sum(speed * left))
        count, p = len(z) - 1, len(self.corner)
        both, band = (x.reshape(-1, n, x.shape[1]) for x in (self.both, self.band.T))

        def by_cell(x: Array) -> Array:
            """Return sums of a value of each sample, cell by cell, shape (cell,)."""
            return np.bincount(cell, x, minlength=count).astype(np.float64)

        for k in range(4):
            rows = slice(k, k + 2 * count, 2)  # position and velocity of a node follow each other
            both[rows, :, p] += np.stack([by_cell(w[k] * x) for x in left.T], axis=-1)
            both[rows, :, p - 1] -= np.stack([by_cell(w[k] * x) for x in (speed / sigma**2).T], axis=-1)
            for m in range(k + 1):
                band[slice(m, m + 2 * count, 2), :, n * (k - m)] += by_cell(w[k] * w[m])[:, None] / sigma**2

    def _add_velocities(self, z: Array, noise: Noise) -> None:
        weight, left = noise.velocity**-2, noise.wanted - z[:, 1]
        self.cost += float(np.sum(weight * left**2))
        n = z.shape[-1]
        rows = (2 * n * np.arange(len(z))[:, None] + n + np.arange(n)).ravel()
        self.band[0, rows] += weight.ravel()
        self.b_nodes[rows, 0] += (weight * left).ravel()

    def _add_torques(
        self, cells: Cells, basis: Basis, X: Array, z: Array, noise: Noise, part: slice, signs: Array | None
    ) -> None:
        nodes = z[part.start : part.stop + 1]
        D, jumps = _columns(cells, basis, nodes, noise.turns.at(z), part)
        both, T = _slopes_of(cells, basis, X, nodes), cells.period
        J = np.stack([_by_nodes(slope, hermite(s, T)) for s, slope in zip(GAUSS, both, strict=True)])
        groups, every = (noise.known, noise.turns.near), list[tuple[Array, Array, Array]]()
        for sign, tau, sigma in ((1.0, cells.torque[0], noise.mean), (-1.0, cells.torque[1], noise.half)):
            # Mean of both points, and half of what the second has more than the first.
            scale = 1 / sigma[:, part].T
            W, H = ((x[1] + sign * x[0]) / 2 for x in (D, J))
            jumps.add(W, H, X, sign)
            rho = (tau[:, part].T - np.matmul(W, X)) * scale
            every.append((W * scale[..., None], H * scale[..., None], rho))
        W, H, rho = (np.concatenate(both, axis=1) for both in zip(*every, strict=True))
        self.cost += float(np.sum(rho**2))
        n = basis.n
        right = np.zeros((*rho.shape, 1 + (0 if signs is None else len(signs) * 2 * n)))
        right[..., 0] = rho
        if signs is not None:
            others = right[:, :n, 1:].reshape(len(rho), n, 2, n, len(signs))
            for j in range(n):
                others[:, j, :, j] = np.stack([signs[:, j, part].T * group[j, part, None] for group in groups], axis=1)
            right[:, :n, 1:] = others.reshape(len(rho), n, -1)
        self._add_cells(part.start, np.swapaxes(H, -1, -2), W, right)

    def _add_cells(self, first: int, H: Array, W: Array, rho: Array) -> None:
        """Add residuals rho, (cell, joint, right), of slopes H, (cell, 4 n, joint), by nodes and W, (cell, joint, p), by X."""
        (count, width), p = H.shape[:2], W.shape[-1]
        # Of a copy: a product with the own transpose goes to BLAS's syrk, three times slower for matrices as small as these.
        own = np.matmul(H, np.swapaxes(H, -1, -2).copy())
        products = np.matmul(H, np.concatenate([W, rho], axis=-1))
        step = width // 2
        nodes = self.both.reshape(-1, step, self.both.shape[1])
        columns = self.band.T.reshape(-1, step, width)  # of the lower half: from the diagonal on
        for half in (0, 1):
            there, rows = slice(first + half, first + half + count), slice(half * step, (half + 1) * step)
            nodes[there, :, :p] += products[:, rows, :p]
            nodes[there, :, p + 1 :] += products[:, rows, p:]
            for j in range(step):
                k = half * step + j
                columns[there, j, : width - k] += own[:, k, k:]
        flat = W.reshape(-1, W.shape[-1])
        self.corner[:-1, :-1] += flat.T @ flat
        self.b_parameters[:-1] += flat.T @ rho.reshape(len(flat), -1)


def torque_squares(cells: Cells, basis: Basis, X: Array, z: Array, noise: Noise) -> Array:
    """Return the squared residuals of a log's mean torques over their variances, in sum, shape (2, joint).

    Where joints move on, and near reversals.
    """
    inside, total = noise.turns.at(z), np.zeros((2, basis.n))
    for part in _chunks(cells.count):
        D, jumps = _columns(cells, basis, z[part.start : part.stop + 1], inside, part)
        W = (D[0] + D[1]) / 2
        jumps.add(W, np.zeros((*W.shape[:2], 4 * basis.n)), X, 1.0)
        squares = ((cells.torque[0][:, part] - np.matmul(W, X).T) / noise.mean[:, part]) ** 2
        total += [np.sum(squares * group[:, part], axis=-1) for group in (noise.known, noise.turns.near)]
    return total


def _columns(cells: Cells, basis: Basis, nodes: Array, inside: Inside, part: slice) -> tuple[Array, Jumps]:
    """Return the columns of a part of the cells at both Gauss points, shape (point, cell, joint, p), and their jumps inside."""
    points = [(q, signed(qd, inside.sign[:, part]), qdd) for q, qd, qdd in (cells.motion(nodes, s) for s in GAUSS)]
    D = np.stack([observation(basis, *point) for point in points])
    return D, inside.jumps(basis, points, D, part)


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
