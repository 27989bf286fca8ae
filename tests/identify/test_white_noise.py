"""Errors of counts that a periodic motion repeats, and sigma on moves and Fourier series where counts are the only noise."""

from dataclasses import replace

import exact_scara
import numpy as np
import pytest

from idbench.identify import CHAINS, MODELS, MotionLog, Problem, TorqueChannel, identify, scara
from idbench.identify.noise.white_noise import count_noise, repeats, torque_noise
from idbench.sim import load_scenario
from idbench.sim.engine.simulation import simulate

FS, SECONDS = 100.0, 40.0
T = np.arange(0, SECONDS, 1 / FS)


def logged(q, tau=None):
    return MotionLog(FS, q, np.zeros_like(q) if tau is None else tau, TorqueChannel("instantaneous"))


def rounded(q, bits, rng):
    """Return counts of an encoder that begins anywhere within a count, and their standard deviation."""
    count = 2 * np.pi / 2**bits
    start = rng.uniform(-0.5, 0.5, q.shape[-1])
    return count * (np.round(q / count + start) - start), count / np.sqrt(12)


def test_counts_of_four_periods_are_those_of_one(rng):
    q, sigma = rounded(np.sin(2 * np.pi * 0.1 * T)[:, None] + [[0.0, 0.3]], 16, rng)
    np.testing.assert_allclose(repeats([logged(q)], np.full(2, sigma)), 4.0, rtol=1e-3)


def test_other_noise_and_periods_between_samples_do_not_repeat_themselves(rng):
    q = np.sin(2 * np.pi * 0.1 * T)[:, None]
    noise = 1e-4 * rng.standard_normal(q.shape)
    np.testing.assert_allclose(repeats([logged(q + noise)], np.array([1e-4])), 1.0, atol=0.1)
    counts, sigma = rounded(np.sin(2 * np.pi * 0.1013 * T)[:, None], 16, rng)
    np.testing.assert_array_equal(repeats([logged(counts)], np.array([sigma])), 1.0)


def test_half_of_the_noise_repeats_itself(rng):
    """Counts and as much other noise: errors of four periods are correlated by a half, and average as those of 1.6."""
    q, sigma = rounded(np.sin(2 * np.pi * 0.1 * T)[:, None], 16, rng)
    both = repeats([logged(q + sigma * rng.standard_normal(q.shape))], np.array([np.sqrt(2) * sigma]))
    np.testing.assert_allclose(both, 1 + 2 * 0.5 * (3 + 2 + 1) / 4, rtol=0.05)


def test_joints_that_stand_short_logs_and_several_logs(rng):
    q, sigma = rounded(np.sin(2 * np.pi * 0.1 * T)[:, None] * [[1.0, 0.0]], 16, rng)
    assert repeats([logged(q)], np.array([sigma, 0.0]))[1] == 1
    assert repeats([logged(q[:3])], np.full(2, sigma)).tolist() == [1, 1]
    once, _ = rounded(np.sin(2 * np.pi * 0.1 * T[:1000])[:, None] * [[1.0, 1.0]], 16, rng)
    mean = repeats([logged(q[:, [0, 0]]), logged(once)], np.full(2, sigma))
    np.testing.assert_allclose(mean, (4 * 4 + 1) / 5, rtol=1e-3)


def test_a_long_log_goes_on_as_it_begins(rng):
    q, sigma = rounded(np.sin(2 * np.pi * np.arange(2**20) / 2**16)[:, None], 16, rng)
    np.testing.assert_allclose(repeats([logged(q)], np.array([sigma])), 2**4, rtol=0.25)


def fourier(period):
    return lambda seed: exact_scara.series(200, SECONDS, range(1, 6), period, seed, (np.inf, np.inf))


MOTIONS = {
    "moves": lambda seed: exact_scara.moves(200, SECONDS, (0.6, 1.2), 0.0, seed),
    "one period of 40 s": fourier(40),
    "two periods of 20 s": fourier(20),
    "periods of 10.28 s": fourier(1 / 0.09731),
}


@pytest.mark.thorough
@pytest.mark.parametrize("bits", [18, 16, 14, 12])
@pytest.mark.parametrize("motion", MOTIONS)
def test_sigma_of_counts_alone_holds_the_truth(motion, bits, truth):
    """200 logs: errors over sigma are 1 within 0.1, and two sigma hold 93 to 98 % of the parameters.

    Not where the slowest motion meets 12 bits: the noise of its velocities is as large as they are. With 18 bits the
    fastest series shows what the prefilter blurs of friction's jumps, three quarters of sigma: 1.3, and 88 %; 90 % with what
    residuals say of the model.
    """
    if (motion, bits) == ("one period of 40 s", 12):
        pytest.skip("velocities are lost in counts")
    rng, exact = np.random.default_rng([bits, 1]), MOTIONS[motion](bits)
    q = np.array([rounded(one, bits, rng)[0] for one in exact[0]])
    log = logged(q, exact_scara.torque(truth, *exact))
    found = identify(log, scara(), MODELS.create("explicit"))
    z = (found.X - truth) / found.noise_sigma
    blurred = (motion, bits) == ("periods of 10.28 s", 18)
    assert np.sqrt(np.mean(z**2)) == pytest.approx(1.0, abs=0.3 if blurred else 0.1)
    assert (0.88 if blurred else 0.93) < np.mean(np.abs(z) < 2) < 0.98
    assert np.mean(np.abs(found.X - truth) < 2 * found.standard_errors) > (0.90 if blurred else 0.93)


@pytest.mark.parametrize(
    ("name", "lines", "asked"),
    [
        ("ideal", None, False),
        ("ripple", None, False),
        ("ripple", 65536, False),
        ("saturation", 4096, False),
        ("stribeck", 65536, True),
        ("quantization", None, True),
        ("gain", None, True),
    ],
)
def test_where_the_likelihood_is_not_asked_it_would_not_decide(name, lines, asked):
    """The noise is the lesser of what differences show and what makes rows likely, on logs of MuJoCo with ripples, other
    friction, wrong gains, encoders; computed here for all, by the product where it decides."""
    scenario = load_scenario(name)
    if lines:
        scenario = replace(scenario, encoder=replace(load_scenario("quantization").encoder, lines=lines))
    problem = Problem((simulate(scenario).alone(),), scara(), MODELS.create("explicit"), CHAINS.create("idbench"))
    found = problem.noise.torque
    assert ("likely_noise" in problem.__dict__) == asked
    lesser = np.minimum(torque_noise(problem.signals), problem.likely_noise.torque)
    np.testing.assert_allclose(found, np.maximum(lesser, count_noise(problem.logs, "tau")), rtol=1e-9)
