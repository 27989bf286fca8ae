"""What a fit of a servo is without each of its parts: covariance of the parameters, errors of what was left out."""

from dataclasses import dataclass, replace

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.servo.closed_loop import ServoLoop
from idbench.identify.servo.search import Found

UNCORRELATED = 0.05  # Correlation of residuals below which stretches of time are taken as independent

MIN_CLUSTERS = 8
"""Clusters by which a covariance is found at least: of one there is none, of few it is by chance. Where residuals are
correlated over longer times, as an offset is over all of a log, standard errors are then too small."""

MOST_LEVERAGE = 0.99  # Of a cluster on its own fit: beyond, nothing is left of its residuals to say how they scatter


@dataclass(frozen=True, eq=False)
class LeftOut:
    """A fit without each of its clusters, from one step of the search (the jackknife)."""

    inverse: Array
    """Inverse of the curvature of the objective, shape (p, p)."""
    covariance: Array
    """Of the parameters, shape (p, p)."""
    costs: Array
    """Mean of Fair's function of the residuals of each cluster, by the fit without it [rad^2], shape (cluster,)."""


def left_out(found: Found, loop: ServoLoop, c: float, parts: int) -> LeftOut:
    """Jackknife over clusters, and the sandwich covariance H^-1 S H^-1.

    H is the curvature of the objective, S the covariance of its gradient (P. J. Huber, 1967), both those that are left when
    every change of the parameters comes with the best beginnings of the runs. S adds up over runs, or pieces of them, each with
    the residual that it has if it is left out of the fit (CR3: R. M. Bell and D. F. McCaffrey, Survey Methodology 28 (2002)
    169-181): a fall that alone shows viscous friction is fitted closely whatever the friction is.

    Parameters
    ----------
    found, loop
        A fit and its runs.
    c : float
        Scale of Fair's function [rad].
    parts : int
        Stretches of time into which each run is cut (see `stretches`).
    """
    J, r = found.sensitivity, found.residual
    size = np.sqrt((J**2).mean(axis=(0, 1)))
    size = np.where(size > 0, size, 1.0)
    J = J / size
    w = 1 / (1 + np.abs(r) / c)
    free = replace(found.beginnings, w=w**2).without(J)  # w**2: the weight of Fair's function, the derivative of r w
    scores = _summed(free * (w * r)[..., None], parts)
    curvatures = _summed(np.einsum("rti,rtj->rtij", free * (w**2)[..., None], J), parts)
    S, inverse, without = _jackknife(scores, curvatures)
    shifts = (without @ inverse).reshape(parts, len(r), -1)
    lacking = np.concatenate([
        some + np.einsum("rti,ri->rt", part, shift)
        for some, part, shift in zip(np.array_split(r, parts, axis=1), np.array_split(free, parts, axis=1), shifts, strict=True)
    ], axis=1)  # fmt: skip
    u = np.abs(lacking) / c
    costs = _summed(2 * c**2 * (u - np.log1p(u)), parts) / np.maximum(_summed(loop.kept.astype(float), parts), 1.0)
    sizes = np.outer(size, size)
    return LeftOut(np.asarray(inverse / sizes), np.asarray(inverse @ S @ inverse / sizes), costs)


def _jackknife(scores: Array, curvatures: Array) -> tuple[Array, Array, Array]:
    """Return the covariance of the gradient, the inverse of its curvature, and the gradient of each cluster left out."""
    H = curvatures.sum(axis=0)
    H = (H + H.T) / 2
    values, vectors = np.linalg.eigh(H)
    root = vectors * np.sqrt(np.maximum(values, 1e-12 * values.max()))
    back = np.linalg.pinv(root)
    without = np.zeros_like(scores)
    for k, (score, curvature) in enumerate(zip(scores, curvatures, strict=True)):
        leverage, axes = np.linalg.eigh(back @ (curvature + curvature.T) / 2 @ back.T)
        without[k] = root @ (axes @ (axes.T @ (back @ score) / (1 - np.minimum(leverage, MOST_LEVERAGE))))
    clusters = len(scores)
    return without.T @ without * (clusters - 1) / clusters, back.T @ back, without


def _summed(x: Array, parts: int) -> Array:
    """Return sums over parts of each run, shape (cluster, ...)."""
    split = np.array_split(x, parts, axis=1)
    return np.concatenate([part.sum(axis=1) for part in split])


def stretches(found: Found, loop: ServoLoop, clusters: int) -> int:
    """Return into how many stretches runs are cut: enough for so many clusters, no more than correlations allow."""
    r = found.residual
    wanted, least = (int(np.ceil(x / len(r))) for x in (clusters, MIN_CLUSTERS))
    return max(least, min(wanted, loop.samples // _correlated(r)))


def _correlated(r: Array) -> int:
    """Return over how many samples residuals are correlated."""
    power = np.abs(np.fft.rfft(r, 2 * r.shape[1], axis=1)) ** 2
    correlation = np.fft.irfft(power.mean(axis=0))[: r.shape[1]]
    small = np.flatnonzero(correlation < UNCORRELATED * correlation[0])
    return int(small[0]) if len(small) and small[0] > 0 else 1
