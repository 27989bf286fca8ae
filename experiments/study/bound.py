"""The Cramer-Rao bound of a study's runs."""

from collections.abc import Mapping

import numpy as np

from identify import Array, Basis, NoiseLevels, cramer_rao
from sim.engine.run import Run

LEAST = 1e-9
"""Noise [rad, N m] that counts as none: the bound is then that of rounding."""


def bound_of(basis: Basis, simulated: Run, truth: Mapping[str, float]) -> Array:
    """Return the least standard deviation of every parameter that the noise of encoders and torques allows, shape (run, p).

    What else is wrong in a scenario, such as cogging, is no part of it.
    """
    scenario, n = simulated.scenario, basis.n
    noise = NoiseLevels(*(np.maximum(x, LEAST) for x in (scenario.torque.spread(n), scenario.encoder.spread(n))))
    found = cramer_rao(basis, np.array(list(truth.values())), simulated.q, simulated.qd, scenario.fs, noise)
    return np.sqrt(np.diagonal(found, axis1=-2, axis2=-1))
