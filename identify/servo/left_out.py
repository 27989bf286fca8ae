"""What a fit of a servo is without each of its parts: covariance of the parameters, errors of what was left out."""

from dataclasses import dataclass, replace

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.estimators.leave_out import jackknife
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


def cross_validate(found: Found, loop: ServoLoop, c: float, parts: int) -> LeftOut:
    """Jackknife over clusters, and the sandwich covariance H^-1 S H^-1.

    H is the curvature of the objective, S the covariance of its gradient (P. J. Huber, 1967), both those that are left when
    every change of the parameters comes with the best beginnings of the runs. S adds up over runs, or pieces of them, each with
    the residual that it has if it is left out of the fit (CR3: R. M. Bell and D. F. McCaffrey, Survey Methodology 28 (2002)
    169-181): a fall that alone shows viscous friction is fitted closely whatever the friction is. c is the scale of Fair's
    function [rad], `parts` the number of stretches of time into which each run is cut (see `stretches`).
    """
    r = found.residual
    size, J, w, free = fair_rows(found, c)
    scores = _summed(free * (w * r)[..., None], parts)
    curvatures = _summed(np.einsum("rti,rtj->rtij", free * (w**2)[..., None], J), parts)
    inverse, without = _solved(scores, curvatures)
    S = jackknife(without, 0.0)
    shifts = (without @ inverse).reshape(parts, len(r), -1)
    lacking = np.concatenate([
        some + np.einsum("rti,ri->rt", part, shift)
        for some, part, shift in zip(np.array_split(r, parts, axis=1), np.array_split(free, parts, axis=1), shifts, strict=True)
    ], axis=1)  # fmt: skip
    u = np.abs(lacking) / c
    costs = _summed(2 * c**2 * (u - np.log1p(u)), parts) / np.maximum(_summed(loop.kept.astype(float), parts), 1.0)
    sizes = np.outer(size, size)
    return LeftOut(np.asarray(inverse / sizes), np.asarray(inverse @ S @ inverse / sizes), costs)


def fair_rows(found: Found, c: float) -> tuple[Array, Array, Array, Array]:
    """Rows of a fit under Fair's function, in which initial states follow the parameters.

    Sizes of the sensitivities, shape (p,), the sensitivities over these, shape (run, sample, p), the roots of the second
    derivatives of Fair's function, shape (run, sample), and the sensitivities that initial states leave.
    """
    size = np.sqrt((found.sensitivity**2).mean(axis=(0, 1)))
    size = np.where(size > 0, size, 1.0)
    J, w = found.sensitivity / size, 1 / (1 + np.abs(found.residual) / c)
    return size, J, w, replace(found.beginnings, w=w**2).without(J)


def _solved(scores: Array, curvatures: Array) -> tuple[Array, Array]:
    """Inverse of the curvature, and the gradient of each cluster left out, H (H - H_b)^-1 s_b, shape (cluster, p)."""
    H = curvatures.sum(axis=0)
    H = (H + H.T) / 2
    values, vectors = np.linalg.eigh(H)
    root = vectors * np.sqrt(np.maximum(values, 1e-12 * values.max()))
    back = np.linalg.pinv(root)
    without = np.zeros_like(scores)
    for k, (score, curvature) in enumerate(zip(scores, curvatures, strict=True)):
        leverage, axes = np.linalg.eigh(back @ (curvature + curvature.T) / 2 @ back.T)
        without[k] = root @ (axes @ (axes.T @ (back @ score) / (1 - np.minimum(leverage, MOST_LEVERAGE))))
    return back.T @ back, without


def _summed(x: Array, parts: int) -> Array:
    """Sums over parts of each run, shape (cluster, ...)."""
    return np.concatenate([part.sum(axis=1) for part in np.array_split(x, parts, axis=1)])


def stretches(found: Found, loop: ServoLoop, clusters: int) -> int:
    """Number of stretches of each run: enough for so many clusters, no more than correlations allow."""
    r = found.residual
    wanted, least = (int(np.ceil(x / len(r))) for x in (clusters, MIN_CLUSTERS))
    power = np.abs(np.fft.rfft(r, 2 * r.shape[1], axis=1)) ** 2
    correlation = np.fft.irfft(power.mean(axis=0))[: r.shape[1]]
    small = np.flatnonzero(correlation < UNCORRELATED * correlation[0])
    correlated = int(small[0]) if len(small) and small[0] > 0 else 1
    return max(least, min(wanted, loop.samples // correlated))
