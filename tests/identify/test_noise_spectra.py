"""What the noise of a log should look like in the explicit model's residual."""

from dataclasses import replace

import numpy as np
import pytest

from idbench.identify import (
    MODELS,
    MotionLog,
    NoiseLevels,
    NoPrefilter,
    Problem,
    ReversalMask,
    TorqueChannel,
    idbench_chain,
    instants,
    noise_spectra,
    scara,
    spectrum,
)

EXPLICIT = MODELS.create("explicit")


@pytest.mark.parametrize(("position", "torque"), [(2.8e-5, 0.0), (0.0, 0.05), (2.8e-5, 0.05)])
def test_the_spectra_are_those_of_noise_put_into_a_log(position, torque, log, truth, rng):
    """Between 5 and 40 Hz, in the mean to 10 %: the residual of true parameters, over the instants that are not masked."""
    q, tau = log.q + position * rng.standard_normal(log.q.shape), log.tau + torque * rng.standard_normal(log.q.shape)
    noisy = MotionLog(log.fs, q, tau, TorqueChannel("instantaneous"))
    chain = replace(idbench_chain(), prefilter=NoPrefilter(), mask=ReversalMask(width=0.03, taper=0.1))
    problem = Problem((noisy,), scara(), EXPLICIT, chain)
    left = instants(problem.signals[0], scara(), EXPLICIT, problem.chain, truth)
    for joint in (0, 1):
        weight = left.weight[joint]
        f, seen = spectrum(left.residual[joint] * weight, log.fs, 0.5)
        seen = seen / np.sqrt(np.mean(weight**2))
        levels = NoiseLevels(np.full(2, torque), np.full(2, position))
        predicted = np.hypot(*(density[joint] for density in noise_spectra(problem, levels, f)))
        inside = (f > 5) & (f < 40)
        assert np.exp(np.mean(np.log(seen[inside] / predicted[inside]))) == pytest.approx(1, abs=0.1)
