"""The identification of a servo: rows, then the closed loop, law by law and finer from stage to stage."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from idbench.identify.arrays import TINY, Array
from idbench.identify.servo.closed_loop import ServoLoop
from idbench.identify.servo.fit import ServoFit
from idbench.identify.servo.left_out import cross_validate, fair_rows
from idbench.identify.servo.parameters import FURTHER, parameters_of
from idbench.identify.servo.run import ServoRun
from idbench.identify.servo.search import ServoSearch
from idbench.identify.servo.stages import Stages
from idbench.identify.telling import one_thread

APART = 0.01  # By how much an offset is changed to see what that does to other joints [rad]

INSEPARABLE = 100.0
"""Condition number from which on offsets cannot be told apart: what gravity says of one, another can make up for."""


class OffsetJoint(NamedTuple):
    """The fit of a joint, and the offsets of others that its loads assume."""

    fit: ServoFit
    """The fit."""
    per_offset: dict[int, Array]
    """By how much its free parameters change per rad of the offset of another joint, shape (p,), by the number of that
    joint."""


def per_offset(fit: ServoFit, runs: Sequence[ServoRun], other: Sequence[ServoRun]) -> Array:
    """Derivative of the free parameters of a fit by another joint's position offset [rad], shape (p,).

    The other runs are those of the fit, with their loads if the offset of the other joint is larger by `APART`.
    """
    with one_thread():
        q, moved = (ServoLoop(runs, fit.loop.h).simulate(fit.p)[0] for runs in (runs, other))
    size, J, w, free = fair_rows(fit.found, 3 * fit.scale)
    free = free * w[..., None] ** 2
    pull = np.einsum("rti,rt->i", free, (q - moved) / APART * fit.loop.kept)
    return np.asarray(np.linalg.pinv(np.einsum("rti,rtj->ij", free, J), 1e-12) @ pull / size)


def together(joints: Mapping[int, OffsetJoint], assumed: Mapping[int, float]) -> dict[int, ServoFit]:
    """Fits whose offsets agree with each other, and whose covariances contain the errors of all offsets.

    The free parameters of joint j are linear in the offsets o of the others, near those that its loads assume:
    theta_j + B_jk (o_k - assumed_k). Its own offset is one of them, so that the offsets solve a linear system. Where gravity
    does not tell them apart, fits stay as they are. Joints whose torques have no scale have no part in it. Fits and assumed
    offsets [rad] are by the number of the joint.
    """
    sources = [k for k in assumed if k in joints and "offset" in joints[k].fit.free]
    own = {k: joints[k].fit.free.index("offset") for k in sources}
    as_they_are = {j: joint.fit for j, joint in joints.items()}
    if not sources:
        return as_they_are
    none = {j: np.zeros(len(fit.free)) for j, fit in as_they_are.items()}
    B = {j: np.stack([of.per_offset.get(k, none[j]) for k in sources], axis=-1) for j, of in joints.items()}
    coupled = np.eye(len(sources)) - np.array([B[k][own[k]] for k in sources])
    if np.linalg.cond(coupled) > INSEPARABLE:
        return as_they_are
    agreed = np.linalg.inv(coupled)
    ahead = agreed @ np.array([joints[k].fit.p["offset"] - assumed[k] for k in sources])
    return {j: _moved(joint.fit, B[j] @ ahead, _covariance(j, joints, B[j] @ agreed, own)) for j, joint in joints.items()}


def _covariance(j: int, joints: Mapping[int, OffsetJoint], per_error: Array, own: Mapping[int, int]) -> Array:
    """Covariance of joint j; `per_error` is the derivative of its parameters by each offset, shape (p, source)."""
    more, all_of = np.eye(len(per_error)), np.zeros((len(per_error), len(per_error)))
    for column, (k, place) in zip(per_error.T, own.items(), strict=True):
        if k == j:
            more[:, place] += column
        else:
            all_of += np.outer(column, column) * joints[k].fit.covariance[place, place]
    return np.asarray(more @ joints[j].fit.covariance @ more.T + all_of)


def _moved(fit: ServoFit, by: Array, covariance: Array) -> ServoFit:
    moved = np.clip(np.array([fit.p[name] for name in fit.free]) + by, *fit.loop.limits(fit.free))
    p = {**fit.p, **dict(zip(fit.free, moved.tolist(), strict=True))}
    return replace(fit, found=replace(fit.found, p=p), of_all=covariance)


def identify_servo(
    runs: Sequence[ServoRun], friction: str = "load", more: Sequence[str] = (), held: dict[str, float] | None = None
) -> ServoFit:
    """Parameters of a servo, from commands and positions alone.

    Rows that are linear in all but delay and rate limit make the start (`ServoRows`); the closed loop, simulated from the
    commands, is then fitted to the positions (`Search`): with the simpler laws of friction first, each the start of the next.

    Parameters
    ----------
    runs : sequence of ServoRun
        What was logged, with known loads, and what is known of the loop.
    friction : str
        A law of `SERVO_FRICTIONS`.
    more : sequence of str
        Further parameters to be found, of `FURTHER`.
    held : dict of str to float, optional
        Parameters that are known, by their letters.

    Raises
    ------
    IdentificationError
        If nothing moves, torque is never on, duty always at its limit, or commands cannot explain the motion.
    SettingError
        If a name is unknown.
    """
    parameters_of(friction, (*more, *(held or {})))
    return Stages.start(runs, more, held or {}).fit(friction, more)


def with_friction(fit: ServoFit, friction: str) -> ServoFit:
    """A fit with a simpler law of friction, which begins with what friction was on average; all else stays as it is."""
    kept = parameters_of(friction, [name for name in fit.p if name in FURTHER])
    loads = [np.abs(run.load.torque(run.t, run.clean)).mean() for run in fit.loop.runs]
    per_load = sum(fit.p.get(name, 0.0) for name in ("Fl", "Fle", "Fgd"))
    p = {name: x for name, x in fit.p.items() if name in kept} | {"Fs": fit.p["Fs"] + per_load * float(np.mean(loads))}
    if not (free := tuple(name for name in ("Fs", "Fv") if name in fit.free)):
        return replace(fit, friction=friction, free=(), found=replace(fit.found, p=p))
    held = {name: x for name, x in p.items() if name not in free}
    return Stages(fit.loop.runs, held, p, cut=False).fit_fine(friction, free, p)


def identify_again(fit: ServoFit, runs: Sequence[ServoRun]) -> ServoFit:
    """Fit of the same parameters, from where it is, to runs whose loads are known better.

    Raises
    ------
    IdentificationError
        As for `identify_servo`.
    """
    held = {name: x for name, x in fit.p.items() if name not in fit.free}
    return Stages(runs, held, fit.p).fit_fine(fit.friction, fit.free, fit.p, fit.contrasts)


OF_JOINT = ("offset", "bias", "zero", "scale_error", "Mg")  # Parameters of a joint; all others are those of its motor


def tied(fits: Mapping[int, ServoFit], names: Collection[str] = ()) -> dict[int, ServoFit]:
    """Fits of joints with one value of each parameter of their motor, or of some of them.

    With x_j the parameters of joint j, c those of its motor, H_j the curvature of its objective over the variance of its
    residuals, and M_j that of c with the others free (Schur complement), the motor's are

        c = N sum M_j c_j,   cov(c) = B N (sum M_j C_j M_j) N,   N = (sum M_j)^-1

    C_j being the covariance of each joint's own c_j, and B, Birge's ratio, at least 1, how much more they differ than that. The
    parameters of each joint are then fitted again.
    """
    first = next(iter(fits.values()))
    known = [name for name in first.free if all(name in fit.free for fit in fits.values())]
    common = [name for name in known if (name in names if names else name not in OF_JOINT)]
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
