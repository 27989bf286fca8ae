"""Friction as smooth functions of velocity, whose sizes the logs decide."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from idbench.experiments.identification.friction_laws import said
from idbench.identify import Array, Basis, MotionLog
from idbench.identify.arrays import TINY
from idbench.identify.parameters.prior import NormalPrior
from idbench.identify.rows.factors import triangular

if TYPE_CHECKING:
    from idbench.experiments.identification.request import Request

BESIDE = "standard+load"
"""Laws beside the smooth functions."""

FINE = 0.1
"""Velocity below which functions are fine, over the joint's rms speed: where friction laws differ most."""

BEGIN = 0.1
"""Standard deviation of the functions, over the rms torque, where the evidence begins, and where no log has been asked."""

ROUNDS, CLOSE = 60, 0.01
"""Iterations at most, and the relative change of a size at which they end."""

LEAST = 1e-4
"""Least size, over the rms torque."""

FREE = 0.1
"""Functions of a joint that the log decides at least."""


def smoothed(request: "Request", logs: tuple[MotionLog, ...]) -> "Request":
    """Return a request with smooth functions of each joint's velocity, of the sizes that make the logs most likely.

    tau_j = W_j x + Z_j u_j + e_j with u_j ~ N(0, s_j^2 I), and by their evidence

        s_j^2 = u_j' u_j / (K - tr C_j / s_j^2),   C the inverse of the whole normal matrix,

    K being the number of functions of a joint (a linear mixed model; D. J. C. MacKay, "Bayesian interpolation", Neural
    Computation 4 (1992) 415-447).
    """
    robot_model = request.robot_model
    plain = replace(request, robot_model=robot_model.plain).problem(logs)
    speed = np.sqrt(np.mean([np.mean(part.state.qd**2, axis=-1) for part in plain.signals], axis=0))
    joints = robot_model.robot.joints
    words = tuple(f"{said(j, joints)}={BESIDE}+smooth:{max(FINE * v, 1e-3):.4g}" for j, v in enumerate(speed))
    made = replace(request, robot_model=replace(robot_model, asked=replace(robot_model.asked, friction=words)))
    begin = sizes_of(logs)
    problem = replace(made, smooth=begin).problem(logs)
    return replace(made, smooth=tuple(_evidence(problem.factors.fit(2).factor.R, problem.basis, np.array(begin)).tolist()))


def sizes_of(logs: tuple[MotionLog, ...]) -> tuple[float, ...]:
    """Return standard deviations of the functions of each joint before a log is asked [N m]."""
    tau = np.concatenate([log.tau * np.asarray(log.torque.gain) for log in logs])
    return tuple((BEGIN * np.sqrt(np.mean(tau**2, axis=0))).tolist())


def places_of(basis: Basis) -> tuple[list[int], list[int]]:
    """Return the places of the functions among the parameters, and their joints."""
    found = [(i, p.joint or 0) for i, p in enumerate(basis.parameters) if p.is_random_effect]
    return [i for i, _ in found], [joint for _, joint in found]


def prior_of(basis: Basis, sizes: tuple[float, ...]) -> NormalPrior:
    """Return what is known of the functions: they are near zero."""
    places, joints = places_of(basis)
    eye = np.eye(len(basis.parameters))[:, places]
    return NormalPrior.of(eye, np.zeros(len(places)), np.array(sizes)[joints])


def _evidence(R: Array, basis: Basis, sizes: Array) -> Array:
    """Return the sizes that make rows, divided by their noise, with the factor R, most likely."""
    places, joints = places_of(basis)
    own = [np.array(joints) == j for j in range(basis.n)]
    least = LEAST * sizes / BEGIN
    for _ in range(ROUNDS):
        whole = triangular(np.concatenate([R, prior_of(basis, tuple(sizes)).known]))
        root = np.linalg.inv(whole[:-1, :-1])
        X, variance = root @ whole[:-1, -1], np.sum(root**2, axis=1)
        u, c = X[places], variance[places]
        found = sizes.copy()
        for j, mine in enumerate(own):
            decided = max(float(mine.sum() - c[mine].sum() / max(sizes[j] ** 2, TINY)), FREE)
            found[j] = max(float(np.sqrt(np.sum(u[mine] ** 2) / decided)), least[j]) if mine.any() else sizes[j]
        done = (np.abs(np.log(found / sizes)) < CLOSE).all()
        sizes = found
        if done:
            break
    return sizes
