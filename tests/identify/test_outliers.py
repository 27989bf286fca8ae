"""Wild samples: found where they are, and what they cost."""

from dataclasses import replace

import numpy as np
import pytest
from builders import closed

from idbench.identify import ESTIMATORS, ExplicitModel, identify, scara
from idbench.identify.estimators import IterativelyReweighted
from idbench.identify.signals.wild_samples import without_wild_samples
from idbench.sim.scenario.measurement import TorqueMeasurement


@pytest.fixture(scope="module")
def noisy():
    """Eight logs with torque noise, and the same with one sample in fifty off: torques by 50 N m, positions by a degree."""
    rng, (_, log) = np.random.default_rng(3), closed(16, 8, torque=TorqueMeasurement(noise=(0.05, 0.005)))
    where = [rng.random(log.q.shape) < 0.02 for _ in range(2)]
    tau = log.tau + where[0] * rng.uniform(-50, 50, log.tau.shape) * [1.0, 0.1]
    return log, replace(log, tau=tau), replace(log, tau=tau, q=log.q + where[1] * rng.uniform(-0.017, 0.017, log.q.shape))


@pytest.mark.thorough
def test_wild_samples_cost_less_than_twice_the_error(noisy, truth):
    """Typical error of eight runs. Ordinary least squares breaks, and weighted as well."""

    def error(log, name):
        X = identify(log, scara(), ExplicitModel(), estimator=ESTIMATORS.create(name)).X
        return np.exp(np.mean(np.log(np.sqrt(np.mean((X / truth - 1) ** 2, axis=0)))))

    clean, *wild = noisy
    assert error(clean, "IRLS") < 1.3 * error(clean, "WLS")
    assert all(error(log, "IRLS") < 2 * error(clean, "WLS") for log in wild)
    assert all(error(log, "OLS") > 50 * error(clean, "OLS") for log in wild)


def test_irls_has_a_calibrated_sigma(noisy, truth):
    """Of eight runs with eight parameters, to a quarter; with wild samples it says more than is wrong, never less."""
    clean, wild, _ = (identify(log, scara(), ExplicitModel(), estimator=IterativelyReweighted()) for log in noisy)
    rms = [np.sqrt(np.mean(((found.X - truth) / found.standard_errors) ** 2)) for found in (clean, wild)]
    assert rms[0] == pytest.approx(1, abs=0.25)
    assert 0.4 < rms[1] < 1.1


def test_wild_samples_are_found_and_no_others(rng):
    t = np.arange(2000) / 100
    smooth = np.sin(2 * t) + 1e-4 * rng.standard_normal(t.shape)
    where = np.array([100, 101, 500, 900, 1500])
    spoilt = smooth.copy()
    spoilt[where] += [0.5, -0.4, 0.01, -0.02, 2.0]
    found, marked = without_wild_samples(spoilt, 1e-5)
    assert marked[where].all()
    assert marked.sum() <= len(where) + 2  # a neighbour or two of those that are side by side
    assert np.abs(found - smooth)[where].max() < 2e-3
    assert not without_wild_samples(smooth, 1e-5)[1].any()


def test_a_joint_that_stands_most_of_the_time_has_no_wild_samples():
    """One move of 1.3 s in 12 s, in counts of 12 bits: where it moves counts jump, as they must."""
    t = np.arange(1200) / 100
    s = np.clip((t - 5) / 1.3, 0, 1)
    step = 2 * np.pi / 2**12
    counts = np.round((10 * s**3 - 15 * s**4 + 6 * s**5) / step) * step
    assert without_wild_samples(counts, 1e-5)[1].sum() == 0
