"""Standard errors that contain the error of the model: none where residuals are noise, all of it where they are more."""

from dataclasses import replace

import numpy as np
import pytest
import scipy

from idbench.identify import ESTIMATORS, MODELS, MotionLog, Problem, estimate, idbench_chain, identify, scara
from idbench.identify.estimators.leave_out import between_logs

LEVEL = np.array([0.5, 0.025])
"""Of the error of the torques [N m]."""


def slow(rng, shape, fs, time):
    """Return an error of the first order with a correlation time, of variance 1, along the axis before the last."""
    a = np.exp(-1 / (fs * time))
    drawn = rng.standard_normal(shape) * np.sqrt(1 - a**2)
    drawn[..., 0, :] /= np.sqrt(1 - a**2)
    return scipy.signal.lfilter([1.0], [1.0, -a], drawn, axis=-2)


def draws(log, error):
    return MotionLog(log.fs, np.broadcast_to(log.q, error.shape), log.tau + LEVEL * error, log.torque)


@pytest.mark.thorough
@pytest.mark.parametrize("estimator", ["OLS", "WLS", "GLS"])
@pytest.mark.parametrize("model", ["explicit", "implicit", "power"])
def test_white_noise_is_no_error_of_the_model(log, model, estimator, rng):
    """40 draws: sigma is at most 1.1 times that of noise, and friction does not change."""
    found = identify(
        draws(log, rng.standard_normal((40, *log.tau.shape))),
        scara(),
        MODELS.create(model),
        estimator=ESTIMATORS.create(estimator),
    )
    assert np.median(found.standard_errors / found.noise_sigma) < 1.1
    assert (found.standard_errors >= found.noise_sigma * (1 - 1e-12)).all()


@pytest.mark.parametrize("time", [pytest.param(0.2, marks=pytest.mark.thorough), 0.7])
def test_slow_errors_of_the_torque_are_held(log, truth, time, rng):
    """40 draws: noise alone holds three quarters of the truths at most, sigma nearly all."""
    found = identify(draws(log, slow(rng, (40, *log.tau.shape), log.fs, time)), scara(), MODELS.create("explicit"))
    noise, whole = (np.mean(np.abs(found.X - truth) < 2 * sigma) for sigma in (found.noise_sigma, found.standard_errors))
    assert noise < 0.75
    assert whole > 0.93


@pytest.mark.thorough
def test_the_jackknife_is_the_scatter(log, rng):
    """Sigma is the standard deviation of 200 draws to a third."""
    found = identify(draws(log, slow(rng, (200, *log.tau.shape), log.fs, 0.3)), scara(), MODELS.create("explicit"))
    ratio = np.sqrt(np.mean(found.standard_errors**2, axis=0)) / found.X.std(axis=0)
    assert ratio.min() > 0.67
    assert ratio.max() < 1.34


def test_what_moves_between_logs(log, truth, rng):
    """Five logs with a rotor of their own: tau^2 of ZZR1 is near the variance of what was put in, that of ZZ2 is small.

    A variance of five is known to a factor: chi^2 of 4 degrees of freedom is within 0.2 and 3.7 times its mean in 99.8 %.
    """
    moved, logs = 0.3 * rng.standard_normal(5), list[MotionLog]()
    qdd = np.gradient(np.gradient(log.q[:, 0], 1 / log.fs), 1 / log.fs)
    for change in moved:
        tau = log.tau + LEVEL * rng.standard_normal(log.tau.shape)
        tau[:, 0] += change * qdd
        logs.append(replace(log, tau=tau))
    found = identify(logs, scara(), MODELS.create("explicit"))
    scatter = np.sqrt(dict(zip(found.names, found.between_logs.variance, strict=True))["ZZR1"])
    assert scatter == pytest.approx(moved.std(ddof=1), rel=0.2)
    k = found.names.index("ZZR1")
    assert found.standard_errors[k] == pytest.approx(scatter / np.sqrt(5), rel=0.2)
    assert np.sqrt(found.between_logs.variance[found.names.index("ZZ2")]) < 0.02 * truth[3] + 0.01


def test_there_is_nothing_between_one_log(log):
    one = identify(log, scara(), MODELS.create("explicit"))
    assert one.between_logs is None
    problem = Problem((log,), scara(), MODELS.create("explicit"), idbench_chain())
    ols = estimate(problem, ESTIMATORS.create("OLS"))
    assert between_logs(problem.parts, ols.solution) is None
