"""Friction as smooth functions of velocity, whose sizes the logs decide."""

import numpy as np

from idbench.identify import Basis, MotionLog
from idbench.identify.parameters.prior import normal_prior
from idbench.identify.rows.factors import Prior

BEGIN = 0.1
"""Standard deviation of the functions, over the rms torque, where the evidence begins, and where no log has been asked."""


def sizes_of(logs: tuple[MotionLog, ...]) -> tuple[float, ...]:
    """Return standard deviations of the functions of each joint before a log is asked [N m]."""
    tau = np.concatenate([log.tau * np.asarray(log.torque.gain) for log in logs])
    return tuple((BEGIN * np.sqrt(np.mean(tau**2, axis=0))).tolist())


def places_of(basis: Basis) -> tuple[list[int], list[int]]:
    """Return the places of the functions among the parameters, and their joints."""
    found = [(i, p.joint or 0) for i, p in enumerate(basis.parameters) if p.is_random_effect]
    return [i for i, _ in found], [joint for _, joint in found]


def prior_of(basis: Basis, sizes: tuple[float, ...]) -> Prior:
    """Prior of the functions: they are near zero."""
    places, joints = places_of(basis)
    eye = np.eye(len(basis.parameters))[:, places]
    return normal_prior(eye, np.zeros(len(places)), np.array(sizes)[joints])
