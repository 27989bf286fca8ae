"""The covariance of the parameters of a servo, from the scatter of the residuals."""

import numpy as np

from identify.arrays import Array
from identify.servo.closed_loop import ServoLoop
from identify.servo.search import Found

CLUSTERS = 2.0
"""Clusters per parameter: where there are fewer runs, or pieces of them, these are cut into stretches of time."""

UNCORRELATED = 0.05
"""Correlation of residuals below which stretches of time are taken as independent."""

MOST_LEVERAGE = 0.99
"""Of a cluster on its own fit: beyond, nothing is left of its residuals to say how they scatter."""


def covariance(found: Found, loop: ServoLoop, c: float) -> Array:
    """Return H^-1 S H^-1: H the curvature of the objective, S the covariance of its gradient (P. J. Huber, 1967).

    Both are those that are left when every change of the parameters comes with the best beginnings of the runs. S adds up over
    runs, or pieces of them, each with the residual that it would have if it were left out of the fit (the jackknife, CR3: R. M.
    Bell and D. F. McCaffrey, Survey Methodology 28 (2002) 169-181): a fall that alone shows viscous friction is fitted closely
    whatever the friction is.
    """
    J, r = found.sensitivity, found.residual
    size = np.sqrt((J**2).mean(axis=(0, 1)))
    size = np.where(size > 0, size, 1.0)
    J = J / size
    w = 1 / (1 + np.abs(r) / c)
    free = found.beginning.free_of(J, w**2)  # w**2: the weight of Fair's function, the derivative of r w
    parts = _parts(r, loop, J.shape[-1])
    scores = _summed(free * (w * r)[..., None], parts)
    curvatures = _summed(np.einsum("rti,rtj->rtij", free * (w**2)[..., None], J), parts)
    S, inverse = _jackknife(scores, curvatures)
    return np.asarray(inverse @ S @ inverse / np.outer(size, size))


def _jackknife(scores: Array, curvatures: Array) -> tuple[Array, Array]:
    """Return the covariance of the gradient, and the inverse of its curvature."""
    H = curvatures.sum(axis=0)
    H = (H + H.T) / 2
    values, vectors = np.linalg.eigh(H)
    root = vectors * np.sqrt(np.maximum(values, 1e-12 * values.max()))
    back = np.linalg.pinv(root)
    left_out = np.zeros_like(scores)
    for k, (score, curvature) in enumerate(zip(scores, curvatures, strict=True)):
        leverage, axes = np.linalg.eigh(back @ (curvature + curvature.T) / 2 @ back.T)
        left_out[k] = root @ (axes @ (axes.T @ (back @ score) / (1 - np.minimum(leverage, MOST_LEVERAGE))))
    clusters = len(scores)
    return left_out.T @ left_out * (clusters - 1) / clusters, back.T @ back


def _summed(x: Array, parts: int) -> Array:
    """Return sums over parts of each run, shape (cluster, ...)."""
    split = np.array_split(x, parts, axis=1)
    return np.concatenate([part.sum(axis=1) for part in split])


def _parts(r: Array, loop: ServoLoop, parameters: int) -> int:
    """Return into how many stretches runs are cut: enough, but none shorter than residuals are correlated."""
    wanted = int(np.ceil(CLUSTERS * parameters / len(r)))
    return max(1, min(wanted, loop.samples // _correlated(r)))


def _correlated(r: Array) -> int:
    """Return over how many samples residuals are correlated."""
    power = np.abs(np.fft.rfft(r, 2 * r.shape[1], axis=1)) ** 2
    correlation = np.fft.irfft(power.mean(axis=0))[: r.shape[1]]
    small = np.flatnonzero(correlation < UNCORRELATED * correlation[0])
    return int(small[0]) if len(small) and small[0] > 0 else 1
