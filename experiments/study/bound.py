"""The Cramer-Rao bounds of a study's runs."""

from collections.abc import Mapping

import numpy as np

from idbench.experiments.study.statistics import BOUNDS
from idbench.identify import Array, Basis, NoiseLevels, cramer_rao
from idbench.sim.engine.run import Run

MIN_NOISE = 1e-9  # Noise [rad, N m] that counts as none: the bound is then that of rounding


def bounds_of(basis: Basis, simulated: Run, truth: Mapping[str, float]) -> dict[str, Array]:
    """Return the least standard deviations of every parameter that the noise of encoders and torques allows, shape (run, p).

    What else is wrong in a scenario, such as cogging, is no part of them.
    """
    scenario, n = simulated.scenario, basis.n
    noise = NoiseLevels(*(np.maximum(x, MIN_NOISE) for x in (scenario.torque.spread(n), scenario.encoder.spread(n))))
    X = np.array(list(truth.values()))
    found = {
        name: cramer_rao(basis, X, simulated.q, simulated.qd, scenario.fs, noise, reversals=reversals)
        for name, reversals in zip(BOUNDS, (False, True), strict=True)
    }
    return {name: np.sqrt(np.diagonal(C, axis1=-2, axis2=-1)) for name, C in found.items()}
