"""Total least squares."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.errors import IdentificationError, require_whole
from idbench.identify.estimators.estimate import Estimate
from idbench.identify.estimators.estimator import AbstractEstimator
from idbench.identify.estimators.problem import Problem
from idbench.identify.estimators.simulating.row_products import Kinds, solve_with
from idbench.identify.rows.factors import Status, triangular

EXACT = 1e-9
"""Share of its squares below which noise of a combination of columns counts as none: it is exact, as that of an offset."""

APART = 2.0  # Ratio by which the squared singular values of W must exceed the least of [W Y], both over their noise
ROUNDING = 1e-15  # Share of the trace of a covariance that is added to its diagonal
FLOOR = 1e-9  # Standard deviation of noise [rad] that counts as none


@dataclass(frozen=True)
class TotalLeastSquares(AbstractEstimator):
    """Mixed total least squares (TLS), scaled by the noise of [W Y]: the smallest change of both that lets them agree.

    X minimises |[W Y] [X' -1]'|^2 / ([X' -1] S [X' -1]') with S the sum over rows of the covariance of the noise of [W Y].
    Noise of the positions in W then leaves no bias, as far as S is right; without its scale it is worse than least squares.
    Combinations of columns without noise are exact (mixed least squares and total least squares: S. Van Huffel and
    J. Vandewalle, "The Total Least Squares Problem: Computational Aspects and Analysis", SIAM 1991, sections 3.6 and 8.3). S of
    W is that of the positions' noise, drawn and put through the chain; that of Y is what is then left over.
    """

    acronym: ClassVar[str] = "TLS"

    draws: int = 8
    """Noises of which S is the mean."""

    def __post_init__(self) -> None:
        require_whole(1, draws=self.draws)

    def solve(self, problem: Problem) -> Estimate:
        """Return the estimate of every run.

        Raises
        ------
        IdentificationError
            If noise hides a direction of the parameters in every run: s_p(W) is not clearly above s_p+1([W Y]).
        """
        rows, kinds = problem.rows, Kinds.of_rows(problem)
        weight = kinds.weights(solve_with(kinds, rows.Y, rows.W, rows.W).residual)
        R = triangular(rows.joined * weight[..., None])
        S = self._noise(problem, weight)
        runs, p = R.shape[:-2], len(problem.names)
        X = np.full((*runs, p), np.nan)
        inverse = np.full((*runs, p, p), np.nan)
        failures = dict[tuple[int, ...], str]()
        for run in np.ndindex(runs):
            if problem.factors.together.status[run] != Status.OK:
                continue
            try:
                X[run], inverse[run] = _solved(R[run], _with_rest(R[run], S[run]))
            except IdentificationError as error:
                failures[run] = str(error)
        if failures and len(failures) == X[..., 0].size:
            raise IdentificationError(next(iter(failures.values())))

        G = np.matmul(rows.W * (weight**2)[..., None], np.swapaxes(inverse, -1, -2))
        return replace(Estimate.judge(problem, X, influence=G), failures=failures)

    def _noise(self, problem: Problem, weight: Array) -> Array:
        """Return the sum over weighted rows of the covariance of [W Y] by noise of the positions, shape (..., p + 1, p + 1)."""
        rng, level = np.random.default_rng(0), np.maximum(problem.position_noise, FLOOR)[..., None, :]
        plain = problem.rows.joined
        total = np.zeros((*plain.shape[:-2], plain.shape[-1], plain.shape[-1]))
        for _ in range(self.draws):
            noisy = [replace(log, q=log.q + level * rng.standard_normal(log.q.shape[-2:])) for log in problem.logs]
            off = (problem.at(noisy).joined - plain) * weight[..., None]
            total = total + np.matmul(np.swapaxes(off, -1, -2), off)
        return total / self.draws


def _with_rest(R: Array, S: Array) -> Array:
    """Return the noise of [W Y] with that of Y as large as the residual, if the noise of W is as stated."""
    p = len(R) - 1
    A, b = R[:, :p].T @ R[:, :p] - S[:p, :p], R[:, :p].T @ R[:, p] - S[:p, p]
    whole = S.copy()
    whole[p, p] = max(S[p, p], float(R[:, p] @ R[:, p] - b @ np.linalg.lstsq(A, b)[0]))
    return whole


def _solved(R: Array, S: Array) -> tuple[Array, Array]:
    """Return X of one run from the factor of [W Y] and the sum of its noise, and the inverse of W' W - lambda S_W."""
    p = len(R) - 1
    size = np.sqrt(np.sum(R**2, axis=0))
    size = np.where(size > 0, size, 1.0)
    R, S = R / size, S / np.outer(size, size)
    # Directions of the columns of W, by how noisy they are; those without noise come first and are exact.
    noise, axes = np.linalg.eigh(S[:p, :p])
    exact = int(np.count_nonzero(noise <= EXACT))
    if exact == p:
        inverse = np.linalg.inv(R[:, :p].T @ R[:, :p])
        return inverse @ (R[:, :p].T @ R[:, p]) * size[p] / size[:p], inverse / np.outer(size[:p], size[:p])
    T = np.zeros((p + 1, p + 1))
    T[:p, :p], T[p, p] = axes, 1.0
    rotated, noise_of = triangular(R @ T), (T.T @ S @ T)[exact:, exact:]
    lower = rotated[exact:, exact:]
    least = _least(lower, noise_of)
    if not (of_W := _least(lower[:, :-1], noise_of[:-1, :-1])) ** 2 > APART * least**2:
        raise IdentificationError(
            "total least squares has no answer: noise makes the columns of W as dependent as those of [W Y] are (their least "
            f"singular values over their noise are {of_W:.3g} and {least:.3g}): filter more (--cutoff), or use IV or GLS"
        )
    inverse = np.linalg.inv(R[:, :p].T @ R[:, :p] - least**2 * S[:p, :p])
    X = inverse @ (R[:, :p].T @ R[:, p] - least**2 * S[:p, p])
    return X * size[p] / size[:p], inverse / np.outer(size[:p], size[:p])


def _least(columns: Array, noise: Array) -> float:
    """Return the least singular value of columns over the root of their noise."""
    L = np.linalg.cholesky(noise + ROUNDING * np.trace(noise) * np.eye(len(noise)))
    return float(np.linalg.svd(np.linalg.solve(L, columns.T), compute_uv=False)[-1])
