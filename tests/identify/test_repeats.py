"""Errors of counts that a periodic motion repeats, and sigma on moves and Fourier series where counts are the only noise."""

import numpy as np
import pytest

from idbench.identify import MODELS, MotionLog, TorqueChannel, identify, scara
from idbench.identify.noise.white_noise import repeats

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


def fourier(rng, base):
    """Return q, qd and qdd of random Fourier series of five harmonics, shape (time, joint) each."""
    w = (2 * np.pi * base * np.arange(1, 6))[:, None]
    s, c = np.sin(w * T), np.cos(w * T)
    a, b = rng.standard_normal((2, 2, 5, 1))
    q, qd, qdd = (np.sum(x, axis=1).T for x in ((a * s - b * c) / w, a * c + b * s, w * (b * c - a * s)))
    size = np.minimum(1.5 / np.abs(q).max(axis=0), 3 / np.abs(qd).max(axis=0))
    return size * q, size * qd, size * qdd


def moves(rng):
    """Return q, qd and qdd of random fifth-order moves with rests, shape (time, joint) each."""
    found = np.zeros((3, len(T), 2))
    for j in range(2):
        start, here = 0.0, 0.0
        while start < SECONDS:
            duration, there = rng.uniform(0.6, 1.2), rng.uniform(-1.5, 1.5)
            moving, way = (start <= T) & (start + duration > T), there - here
            s = (T[moving] - start) / duration
            found[0, moving, j] = here + way * (10 * s**3 - 15 * s**4 + 6 * s**5)
            found[1, moving, j] = way * 30 * (s**2 - 2 * s**3 + s**4) / duration
            found[2, moving, j] = way * 60 * (s - 3 * s**2 + 2 * s**3) / duration**2
            found[0, start + duration <= T, j] = there
            start, here = start + duration + rng.uniform(0.1, 0.3), there
    return tuple(found)


def torque(X, q, qd, qdd):
    """Return the torques of the SCARA, typed from the paper's Eq. 51."""
    ZZR1, Fv1, Fs1, ZZ2, LMX2, LMY2, Fv2, Fs2 = X
    (a1, a2), (v1, v2), c, s = qdd.T, qd.T, np.cos(q[:, 1]), np.sin(q[:, 1])
    both = (2 * a1 + a2) * c - v2 * (2 * v1 + v2) * s, (2 * a1 + a2) * s + v2 * (2 * v1 + v2) * c
    first = ZZR1 * a1 + ZZ2 * (a1 + a2) + LMX2 * both[0] - LMY2 * both[1] + Fv1 * v1 + Fs1 * np.sign(v1)
    second = ZZ2 * (a1 + a2) + LMX2 * (a1 * c + v1**2 * s) - LMY2 * (a1 * s - v1**2 * c) + Fv2 * v2 + Fs2 * np.sign(v2)
    return np.stack([first, second], axis=-1)


MOTIONS = {
    "moves": moves,
    "one period of 40 s": lambda rng: fourier(rng, 1 / 40),
    "two periods of 20 s": lambda rng: fourier(rng, 1 / 20),
    "periods of 10.28 s": lambda rng: fourier(rng, 0.09731),
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
    rng = np.random.default_rng(bits)
    every = [MOTIONS[motion](rng) for _ in range(200)]
    q = np.array([rounded(one[0], bits, rng)[0] for one in every])
    log = logged(q, np.array([torque(truth, *one) for one in every]))
    found = identify(log, scara(), MODELS.create("explicit"))
    z = (found.X - truth) / found.noise_sigma
    blurred = (motion, bits) == ("periods of 10.28 s", 18)
    assert np.sqrt(np.mean(z**2)) == pytest.approx(1.0, abs=0.3 if blurred else 0.1)
    assert (0.88 if blurred else 0.93) < np.mean(np.abs(z) < 2) < 0.98
    assert np.mean(np.abs(found.X - truth) < 2 * found.standard_errors) > (0.90 if blurred else 0.93)
