"""Friction as smooth functions of velocity, whose sizes the logs decide."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from idbench.experiments.identification.friction_laws import said
from idbench.identify import Basis, MotionLog
from idbench.identify.parameters.prior import NormalPrior, evident_sizes

if TYPE_CHECKING:
    from idbench.experiments.identification.request import Request

BESIDE = "standard+load"  # Laws beside the smooth functions

FINE = 0.1
"""Velocity below which functions are fine, over the joint's rms speed: published Stribeck velocities, 0.02 to 0.5 rad/s, are
some tenths of the speeds of brisk motions (Armstrong-Helouvry et al., Automatica 30 (1994) 1083-1138)."""

BEGIN = 0.1
"""Standard deviation of the functions, over the rms torque, where the evidence begins, and where no log has been asked."""


def smoothed(request: "Request", logs: tuple[MotionLog, ...]) -> "Request":
    """Return a request with smooth functions of each joint's velocity, of the sizes that make the logs most likely.

    tau_j = W_j x + Z_j u_j + e_j,   u_j ~ N(0, s_j^2 I),   s_j by `evident_sizes`
    """
    robot_model = request.robot_model
    plain = replace(request, robot_model=robot_model.plain).problem(logs)
    speed = np.sqrt(np.mean([np.mean(part.state.qd**2, axis=-1) for part in plain.signals], axis=0))
    joints = robot_model.robot.joints
    words = tuple(f"{said(j, joints)}={BESIDE}+smooth:{max(FINE * v, 1e-3):.4g}" for j, v in enumerate(speed))
    made = replace(request, robot_model=replace(robot_model, asked=replace(robot_model.asked, friction=words)))
    begin = sizes_of(logs)
    problem = replace(made, smooth=begin).problem(logs)
    places, of = (np.array(each) for each in places_of(problem.basis))
    groups = [places[of == j] for j in range(problem.basis.n)]
    return replace(made, smooth=tuple(evident_sizes(problem.factors.fit(2).factor.R, groups, np.array(begin)).tolist()))


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
