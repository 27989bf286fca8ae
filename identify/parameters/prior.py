"""What is roughly known of parameters, as rows of the normal equations."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from idbench.identify.arrays import TINY, Array
from idbench.identify.basis.block import BODY, Parameter
from idbench.identify.iterate import iterate
from idbench.identify.parameters.bodies import Bodies, nearest
from idbench.identify.rows.factors import Prior, triangular

ROUNDS, CLOSE = 60, 0.01  # Iterations of the evidence at most, and the relative change of a size at which they end
LEAST = 1e-3  # Least size, over the one that the evidence begins with: no log shows a thousandth of a torque

DECIDED = 0.1
"""Parameters of a group that the rows decide at least: the size of a group of which they decide nothing falls slowly."""

PLAIN = 1e-12  # Share of the largest variance that every combination is taken to have at least: more than that is rounding


def normal_prior(K: Array, values: Array, sigma: Array) -> Prior:
    """Prior of base parameters K x, K of shape (b, p), from standard values with standard deviations, shape (p,).

    They are infinite where values are unknown. A base parameter of which a part is not known is not known at all.
    """
    known = np.isfinite(sigma)
    places = (K[:, known] != 0).any(axis=1) & ~(K[:, ~known] != 0).any(axis=1)
    own = K[np.ix_(places, known)]
    rows = _rows(own @ values[known], (own * sigma[known] ** 2) @ own.T, places)
    return lambda _: rows


@dataclass(frozen=True, eq=False)
class FilePrior:
    """Links near those of a file: weight times the log-determinant divergence of `Bodies`, linearized at its minimum.

    The others are weakly known: none makes more than the whole torque alone, so that a short log, too, has an estimate.
    Offsets of the torques are alike in size beside the noise of each joint, and the rows decide how large (`evident_sizes`): a
    joint that has turned one way only shows friction or an offset, and what the others show of theirs decides which.

    With x the standard parameters of links, X = K x base parameters that are made of links alone, and x* the minimum of
    1/2 |R (K x, X_free)|^2 + weight d(x), the rows are those of x* - H^-1 g, with covariance H^-1, g and H the gradient and
    Hessian of weight d at x*: their solution with R is K x*, which bodies can have.
    """

    K: Array
    """What base parameters are made of, shape (b, p)."""
    parameters: Sequence[Parameter]
    """The standard parameters."""
    given: Array
    """Theirs in the file, shape (p,)."""
    share: float
    """Relative change of a link that is expected; the weight is its inverse square."""

    def __call__(self, R: Array) -> Array:
        """Prior rows at the best links for R."""
        links = np.array([p.kind in BODY for p in self.parameters])
        own = (self.K[:, links] != 0).any(axis=1) & ~(self.K[:, ~links] != 0).any(axis=1)
        K = self.K[np.ix_(own, links)]
        bodies = Bodies([p for p in self.parameters if p.kind in BODY], self.given[links], np.ones(int(links.sum())))
        order = np.r_[np.flatnonzero(~own), np.flatnonzero(own)]
        free = int((~own).sum())
        weak = np.zeros((free, R.shape[-1]))
        size = np.linalg.norm(R[:, :-1][:, ~own], axis=0) / max(float(np.linalg.norm(R[:, -1])), TINY)
        weak[np.arange(free), np.flatnonzero(~own)] = size
        weak = self._with_alike(R, weak)
        R = np.concatenate([R, weak])
        part = triangular(R[:, [*order, -1]])[free:, free:]
        x = nearest(part[:, :-1] @ K, part[:, -1], bodies, weight := self.share**-2)
        d = bodies.divergence(x)
        assert d is not None
        root = K @ d.root / np.sqrt(weight)
        return np.concatenate([weak, _rows(K @ x - root @ (d.root.T @ d.gradient) * np.sqrt(weight), root @ root.T, own)])

    def _with_alike(self, R: Array, weak: Array) -> Array:
        """Return weak rows of which those of offsets know them by the size that they have in common."""
        offsets = np.flatnonzero((self.K[:, [p.kind == "offset" for p in self.parameters]] != 0).any(axis=1))
        if not len(offsets):
            return weak
        length = np.maximum(np.linalg.norm(R[:, offsets], axis=0), TINY)
        rows = np.concatenate([R, weak])
        rows[:, offsets] /= length
        (size,) = evident_sizes(rows, [offsets], np.linalg.norm(R[:, -1:], axis=0))
        known = weak.copy()
        known[np.argmax(weak[:, offsets] != 0, axis=0), offsets] = length / size
        return known


def evident_sizes(R: Array, groups: Sequence[npt.NDArray[np.intp]], sizes: Array) -> Array:
    """Return the standard deviations of groups of parameters, each near zero, that make rows most likely.

        s_k^2 = u_k' u_k / (n_k - tr C_k / s_k^2),   C = (R' R + diag(1 / s^2))^-1,  u_k the n_k parameters of a group

    (a linear mixed model; D. J. C. MacKay, "Bayesian interpolation", Neural Computation 4 (1992) 415-447). R has the rows of
    all parameters and of what they make, in units of their noise, shape (r, p + 1), groups the places of their parameters. The
    search begins at sizes, shape (group,): what a group would be if it made the whole.
    """
    least, member = LEAST * sizes, np.repeat(np.arange(len(groups)), [len(group) for group in groups])

    def step(sizes: Array) -> tuple[Array, np.bool_]:
        rows = np.zeros((len(member), R.shape[-1]))
        rows[np.arange(len(member)), np.concatenate(groups)] = 1 / sizes[member]
        whole = triangular(np.concatenate([R, rows]))
        root = np.linalg.inv(whole[:-1, :-1])
        X, variance = root @ whole[:-1, -1], np.sum(root**2, axis=1)
        decided = [max(len(k) - float(variance[k].sum()) / s**2, DECIDED) for k, s in zip(groups, sizes, strict=True)]
        found = np.sqrt([np.sum(X[k] ** 2) / count for k, count in zip(groups, decided, strict=True)])
        found = np.maximum(found, least)
        return found, (np.abs(np.log(found / sizes)) < CLOSE).all()

    return iterate(step, sizes, ROUNDS)[0]


def prior_sum(parts: Sequence[Prior]) -> Prior:
    """Prior of several, each linearized beside the rows and those before it."""

    def rows(R: Array) -> Array:
        found, every = R, list[Array]()
        for part in parts:
            every.append(part(found))
            found = triangular(np.concatenate([found, every[-1]]))
        return np.concatenate(every)

    return rows


def _rows(mean: Array, covariance: Array, places: Array) -> Array:
    """Return [P, P x0] of some base parameters with a mean and a covariance, which may be singular, shape (m, b + 1)."""
    size = np.sqrt(np.diagonal(covariance))
    values, axes = np.linalg.eigh(covariance / np.outer(size, size))
    P = np.zeros((len(size), len(places) + 1))
    root = (axes / np.sqrt(np.maximum(values, PLAIN * values.max(initial=0.0)))).T / size
    P[:, np.flatnonzero(places)], P[:, -1] = root, root @ mean
    return P
