"""How an estimate comes about as the rows come in."""

from dataclasses import dataclass

import numpy as np

from identify.arrays import Array
from identify.errors import IdentificationError
from identify.estimate import Estimate
from identify.system import UNSEEN


@dataclass(frozen=True, eq=False)
class Running:
    """An estimate over time; NaN as long as the rows do not tell every parameter.

    Parameters
    ----------
    t : Array, shape (instant,)
        [s].
    X, sigma : Array, shape (instant, p)
        Parameters and their standard deviation, as far as the rows that are final at `t` tell them.
    """

    t: Array
    X: Array
    sigma: Array


def running_estimate(estimate: Estimate, t: Array, halo: float = 0.0) -> Running:
    """Return what the rows that were final at each instant `t` [s] say, from one triangular factor that takes in row by row.

    The rows are weighted as for the estimate itself, so that the last of it is that estimate. Sigma is that of section 7.3 for
    the rows so far, corrected in the ratio in which that of all rows is corrected.

    Parameters
    ----------
    estimate : Estimate
        A least-squares estimate of a single run.
    t : Array, shape (instant,)
        Increasing [s].
    halo : float
        How long after its time a row is final [s], such as `Chain.halo`.

    Raises
    ------
    IdentificationError
        If the estimate is not that of a single run, or its estimator did not hand in the rows that it solved.
    """
    solved = estimate.solved
    if solved is None or solved.Y.ndim > 1:
        raise IdentificationError("a running estimate needs the rows of a least-squares estimate of one run")
    order = np.argsort(solved.time, kind="stable")
    rows = np.concatenate([solved.W, solved.Y[:, None]], axis=1)[order]
    valid = np.cumsum(solved.valid[order])
    until = np.searchsorted(solved.time[order] + halo, t, side="right")
    p = len(estimate.parameters)
    R, X, sigma, before = np.zeros((p + 1, p + 1)), *np.full((2, len(t), p), np.nan), 0
    for k, now in enumerate(until):
        R = np.linalg.qr(np.concatenate([R, rows[before:now]]), mode="r")  # type: ignore[assignment]  # R alone
        X[k], sigma[k] = _solution(R, int(valid[now - 1]) if now else 0)
        before = int(now)
    ratio = estimate.corrected_sigma / estimate.sigma
    return Running(t, X, sigma * np.where(np.isfinite(ratio), ratio, 1.0))


def _solution(R: Array, rows: int) -> tuple[Array, Array]:
    """Return X and sigma of a triangular factor of [W Y], NaN if it does not tell them."""
    p = len(R) - 1
    length = np.linalg.norm(R[:p, :p], axis=0)
    if rows <= p or not length.all():
        return np.full(p, np.nan), np.full(p, np.nan)
    values = np.linalg.svd(R[:p, :p] / length, compute_uv=False)
    if values[-1] <= UNSEEN * values[0]:
        return np.full(p, np.nan), np.full(p, np.nan)
    inverse = np.linalg.inv(R[:p, :p])
    variance = R[p, p] ** 2 / (rows - p)
    return inverse @ R[:p, p], np.sqrt(variance * np.sum(inverse**2, axis=1))
