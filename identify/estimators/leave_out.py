"""Least squares without each stretch of its rows, and how long stretches are."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple, Self

import numpy as np
import numpy.typing as npt

from idbench.identify.arrays import TINY, Array
from idbench.identify.estimators.log_rows import LogRows
from idbench.identify.estimators.solution import OfWeightedRows, OfWhitenedRows
from idbench.identify.rows.factors import Factor, triangular

STRETCH = 2.0  # Length of a stretch [s]: residuals of real robots are correlated over 0.2 to 3 s
FEWEST = 5  # Stretches at least; those of short logs are shorter

RIDGE, NOTHING = 1e-11, 1e-200
"""Share of its diagonal that is added to a matrix of products, so that what the other stretches do not show stays zero; squares
below which a column counts as none."""


@dataclass(frozen=True)
class Stretches:
    """Stretches of the logs of a fit, numbered through."""

    length: float
    """Of each [s]."""
    first: tuple[int, ...]
    """Number of the first stretch of each log, and one more: their count."""

    @classmethod
    def of(cls, parts: Sequence[LogRows]) -> Self:
        """Stretches of `STRETCH`, or of a fifth of all logs together where that is shorter."""
        times = [float(part.rows.time[-1]) for part in parts]
        length = min(STRETCH, sum(times) / FEWEST)
        return cls(length, tuple(np.cumsum([0, *(max(1, int(np.ceil(t / length))) for t in times)]).tolist()))

    @property
    def count(self) -> int:
        """Number of stretches."""
        return self.first[-1]

    def at(self, k: int, time: Array) -> npt.NDArray[np.intp]:
        """Numbers of the stretches in which instants [s] of log `k` lie; beyond its last row they are of its last stretch."""
        return np.minimum(self.first[k] + (time / self.length).astype(np.intp), self.first[k + 1] - 1)

    def products(self, parts: Sequence[LogRows], rows: Sequence[Array]) -> Array:
        """Products of the columns of rows of each part, shape (r, q), stretch by stretch, shape (stretch, q, q)."""
        pieces = [x[some] for k, (part, x) in enumerate(zip(parts, rows, strict=True)) for some in self.slices(k, part)]
        return np.array([piece.T @ piece for piece in pieces])

    def slices(self, k: int, part: LogRows) -> list[slice]:
        """Rows of each stretch of log `k`."""
        inner = np.searchsorted(self.at(k, part.rows.time), np.arange(self.first[k] + 1, self.first[k + 1]))
        return [slice(int(a), int(b)) for a, b in pairwise([0, *inner, len(part.rows.time)])]


def solved(products: Array, of: Array | None = None) -> Array:
    """Least-squares solutions from products of [W Y], shape (..., p + 1, p + 1), scaled as those of all rows are."""
    A, c = products[..., :-1, :-1], products[..., :-1, -1:]
    size = np.sqrt(np.maximum(np.diagonal(A if of is None else of[:-1, :-1], axis1=-2, axis2=-1), NOTHING))
    scaled = A / size[..., :, None] / size[..., None, :] + RIDGE * np.eye(A.shape[-1])
    return np.asarray(np.linalg.solve(scaled, c / size[..., None])[..., 0] / size)


def left_out(products: Array, known: Array | None = None) -> Array:
    """Estimates without each stretch, and that of all rows after them, shape (stretch + 1, p):

        X_b = (A - A_b)^-1 (c - c_b),   A_b = W_b' W_b,   c_b = W_b' Y_b   of rows made independent.

    Products are those of [W_b Y_b], shape (stretch, p + 1, p + 1); `known`, rows of shape (m, p + 1), are never left out.
    """
    every = products.sum(axis=0) + (0.0 if known is None else known.T @ known)
    return solved(np.concatenate([every - products, every[None]]), every)


def jackknife(without: Array, about: Array | float | None = None) -> Array:
    """Covariance of an estimate from B estimates without a stretch each, shape (stretch, ..., p), shape (..., p, p):

    J = (B - 1) / B sum over b of (X_b - mean) (X_b - mean)'

    or about the estimate of all rows, if that is given.
    """
    count = len(without)
    off = np.moveaxis(without - (without.mean(axis=0) if about is None else about), 0, -1)
    return np.asarray(np.matmul(off, np.swapaxes(off, -1, -2)) * ((count - 1) / count))


def moved(parts: Sequence[LogRows], X: Array, influence: Sequence[Array]) -> Array:
    """X_b - X of any estimate X = G' Y, which is `left_out` of rows made independent:

        X_b - X = -(I - g_b' w_b)^-1 g_b' e_b,   g = L' G,   [w e] = L^-1 [W Y - W X],   L L' being the covariance of the rows.

    Noise of positions is differentiated: sums of rows over a stretch then have it at the ends alone, and a covariance from
    stretches of such rows would be several times too large. X has shape (..., p), the G of each part (..., r, p), the result
    (stretch, ..., p); leading axes are runs.
    """
    stretches, found = Stretches.of(parts), list[Array]()
    one = (1 + RIDGE) * np.eye(X.shape[-1])
    for k, (part, G) in enumerate(zip(parts, influence, strict=True)):
        residual, white = (part.rows.Y - part.rows.predicted(X))[..., None], part.whitening
        g = white.whiten(white.C @ (G * white.kept[..., None]))
        rows = white.whiten(np.concatenate([part.rows.W, residual], axis=-1))
        for some in stretches.slices(k, part):
            products = np.matmul(np.swapaxes(g[..., some, :], -1, -2), rows[..., some, :])
            found.append(-np.linalg.solve(one - products[..., :-1], products[..., -1:])[..., 0])
    return np.array(found)


@dataclass(frozen=True, eq=False)
class ModelError:
    """The error that a wrong model gives an estimate X = G' Y, beyond that of noise. Leading axes are runs."""

    covariance: Array
    """Of the error of X within a log, shape (..., p, p)."""
    scatter: Array
    """Variance of X from log to log beyond that, shape (..., p)."""
    moved: Array
    """X without each stretch, less X, shape (stretch, ..., p)."""

    @classmethod
    def of(cls, parts: Sequence[LogRows], X: Array, influence: Sequence[Array], whole: float, noise: Array) -> Self:
        """Error of an estimate, from its jackknife J over stretches of the logs.

        Residuals of real robots are correlated over 0.2 to 3 s and have effects of any size; J contains noise, too. So of each
        parameter the larger counts: max(0, J - N) is added to the variance N of noise, with the correlations of J. (Fits of
        single logs agree within two sigma in 94 % on a UR10e, 97 % on a Baxter, 100 % on a KR300, by noise alone in 32, 64 and
        41 %.) The parts make the share `whole` of all rows; N has shape (..., p), the others are those of `moved`.
        """
        without = moved(parts, X, influence)
        J = jackknife(without) / whole
        variance = np.diagonal(J, axis1=-2, axis2=-1)
        root = np.sqrt(np.maximum(variance - noise, 0.0) / np.maximum(variance, TINY))
        return cls(J * root[..., :, None] * root[..., None, :], np.zeros(X.shape), without)


class BetweenLogs(NamedTuple):
    """The scatter of parameters between logs."""

    variance: Array
    """Of each parameter between logs, tau^2, shape (p,)."""

    logs: int
    """Number of logs that determine all parameters by themselves."""


def between_logs(parts: Sequence[LogRows], solution: OfWeightedRows | OfWhitenedRows) -> BetweenLogs | None:
    """Return the scatter of parameters between the logs of a fit; None unless two of them determine all parameters.

    With x_i the estimates of one parameter from k logs, w_i = 1 / C_i their weights, and Q = sum w_i (x_i - xbar)^2,

        tau^2 = max(0, (Q - (k - 1)) / (sum w - sum w^2 / sum w))

    (R. DerSimonian and N. Laird, "Meta-analysis in clinical trials", Controlled Clinical Trials 7 (1986) 177-188). An estimate
    from one log is off by C_i + tau^2, that of k logs together by C + tau^2 / k. The parts are logs of a single run.
    """
    names, precision = parts[0].rows.names, np.linalg.pinv(solution.inverse, hermitian=True)
    X, C = list[Array](), list[Array]()
    for part, rows, G in zip(parts, solution.independent(parts), solution.influence(parts), strict=True):
        factor = Factor(triangular(rows), np.array(len(rows)), names)
        if not factor.determined:
            continue
        alone = G @ precision @ factor.inverse(factor.determined)
        X.append(factor.solution(factor.determined))
        noise = part.covariance.of_sums(alone)
        C.append(np.diagonal(noise + ModelError.of([part], X[-1], [alone], 1.0, np.diagonal(noise)).covariance))
    if len(X) < 2:
        return None
    return BetweenLogs(scatter(np.array(X), np.array(C))[1], len(X))


def scatter(x: Array, C: Array) -> tuple[Array, Array]:
    """Q and tau^2 (see `between_logs`) of estimates x with variances C, shape (k, ...) each, shape (...) each."""
    w = 1 / np.maximum(C, TINY)
    whole = w.sum(axis=0)
    Q = np.sum(w * (x - np.sum(w * x, axis=0) / whole) ** 2, axis=0)
    return Q, np.maximum(Q - (len(x) - 1), 0.0) / np.maximum(whole - np.sum(w**2, axis=0) / whole, TINY)
