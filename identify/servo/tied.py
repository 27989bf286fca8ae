"""Joints with the same motor: one value of what belongs to it, and a zero of its own for each."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from idbench.identify.arrays import TINY, Array
from idbench.identify.servo.fit import ServoFit
from idbench.identify.servo.left_out import cross_validate
from idbench.identify.servo.search import ServoSearch
from idbench.identify.servo.stages import Stages

OF_JOINT = ("offset", "bias", "zero", "scale_error", "Mg")  # Parameters of a joint; all others are those of its motor


def tied(fits: Mapping[int, ServoFit]) -> dict[int, ServoFit]:
    """Fits of joints with one value of each parameter of their motor.

    With x_j the parameters of joint j, c those of its motor, H_j the curvature of its objective over the variance of its
    residuals, and M_j that of c with the others free (Schur complement), the motor's are

        c = N sum M_j c_j,   cov(c) = B N (sum M_j C_j M_j) N,   N = (sum M_j)^-1

    C_j being the covariance of each joint's own c_j, and B, Birge's ratio, at least 1, how much more they differ than that. The
    parameters of each joint are then fitted again.
    """
    first = next(iter(fits.values()))
    common = [name for name in first.free if name not in OF_JOINT and all(name in fit.free for fit in fits.values())]
    if len(fits) < 2 or not common:
        return dict(fits)
    places = {j: [fit.free.index(name) for name in common] for j, fit in fits.items()}
    inverses = {j: cross_validate(fit.found, fit.loop, 3 * fit.scale, 1).inverse for j, fit in fits.items()}  # of curvatures
    M = {j: np.linalg.pinv(_part(inverses[j], places[j]), hermitian=True) / fit.scale**2 for j, fit in fits.items()}
    C = {j: _part(fit.covariance, places[j]) for j, fit in fits.items()}
    own = {j: np.array([fit.p[name] for name in common]) for j, fit in fits.items()}
    whole = np.linalg.pinv(sum(M.values(), np.zeros((len(common), len(common)))), hermitian=True)
    c = whole @ sum((M[j] @ own[j] for j in fits), np.zeros(len(common)))
    inner = sum((M[j] @ C[j] @ M[j] for j in fits), np.zeros_like(whole))
    S = whole @ inner @ whole * _spread(c, own, C)
    shared = dict(zip(common, c.tolist(), strict=True))
    return {j: _with(fit, shared, places[j], S, inverses[j]) for j, fit in fits.items()}


def _part(C: Array, places: list[int]) -> Array:
    return C[np.ix_(places, places)]


def _spread(c: Array, own: Mapping[int, Array], C: Mapping[int, Array]) -> float:
    """Birge's ratio: the mean square of differences of each joint from all, in their standard errors, or 1."""
    z = np.concatenate([(own[j] - c) / np.sqrt(np.maximum(np.diagonal(C[j]), TINY)) for j in own])
    return max(1.0, float(np.sum(z**2)) / (len(c) * (len(own) - 1)))


def _with(fit: ServoFit, shared: Mapping[str, float], places: list[int], S: Array, H: Array) -> ServoFit:
    """Fit of a joint whose motor is known, with the covariance that follows; H: inverse of its curvature."""
    others = [k for k in range(len(fit.free)) if k not in places]
    free = tuple(fit.free[k] for k in others)
    p = {**fit.p, **shared}
    held = {name: x for name, x in p.items() if name not in free}
    again = Stages(fit.loop.runs, held, p, cut=False).fit_fine(fit.friction, free, p, fit.contrasts)
    # How parameters of the joint follow its motor's.
    follow = H[np.ix_(others, places)] @ np.linalg.pinv(_part(H, places), hermitian=True)
    C = np.zeros_like(fit.covariance)
    C[np.ix_(places, places)] = S
    C[np.ix_(others, places)] = follow @ S
    C[np.ix_(places, others)] = (follow @ S).T
    if others:
        C[np.ix_(others, others)] = again.covariance + follow @ S @ follow.T
    search = ServoSearch(fit.loop, fit.free, fit.excitation.scales, 3 * fit.scale)
    return replace(fit, found=search.at(again.found), of_all=C)
