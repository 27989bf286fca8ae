"""Alignment against closed-form integrals of a held, an averaged and a delayed torque."""

import numpy as np
import pytest
from scipy.integrate import quad_vec

from idbench.identify import AsLogged, ByChannel, CentralDifference, TorqueChannel

FS = 100.0
PERIOD = 1 / FS
K = np.arange(400)
INNER = slice(20, -20)
DELAYS = [0.0, 0.003, 0.005, 0.007, 0.0149, -0.002]


def qd(t):
    return np.stack([3 * np.cos(3 * t), -2 * np.sin(2 * t) + 0.3])


def smooth(t):
    return np.stack([np.sin(5 * t + 1), np.cos(4 * t)])


def align(tau, meaning, delay):
    return ByChannel().align(tau, TorqueChannel(meaning, delay), FS)


def power_of(torque, velocity):
    return sum(torque.times(x, j) for j, x in enumerate(velocity))


def driven(u, delay):
    """Return exact positions, at the samples, of unit inertias that the held torques `u` drive: parabolas, piece by piece."""
    t, edges = K * PERIOD, K * PERIOD + delay
    position, velocity = np.zeros((2, *u.shape))
    for k in range(len(K) - 1):
        velocity[:, k + 1] = velocity[:, k] + u[:, k] * PERIOD
        position[:, k + 1] = position[:, k] + velocity[:, k] * PERIOD + u[:, k] * PERIOD**2 / 2
    piece = np.clip(np.floor((t - delay) * FS + 1e-9).astype(int), 0, len(K) - 1)
    since = t - edges[piece]
    return position[:, piece] + velocity[:, piece] * since + u[:, piece] * since**2 / 2


@pytest.mark.parametrize("delay", DELAYS)
def test_a_held_torque_is_the_acceleration_that_samples_of_its_motion_show(delay):
    """Newton's second law, for torques at up to 5 rad/s; stages are off by (5/100)^4 or less, images by (5/628)^2."""
    u = smooth(K * PERIOD)
    s = CentralDifference(6)
    motion = driven(u, delay)
    acceleration = s.derivative(s.derivative(motion, FS), FS)
    torque = align(u, "held", delay)
    np.testing.assert_allclose(torque.mean[:, INNER], acceleration[:, INNER], atol=1e-4)
    kinetic = np.sum(s.derivative(motion, FS) ** 2, axis=0) / 2
    power = power_of(torque, s.derivative(motion, FS))
    np.testing.assert_allclose(power[INNER], s.derivative(kinetic, FS)[INNER], atol=2e-4)


@pytest.mark.thorough
@pytest.mark.parametrize("delay", DELAYS)
def test_an_averaged_torque_has_its_mean_and_power(delay):
    def mean_from(t):
        return quad_vec(smooth, t, t + PERIOD)[0] * FS

    u = np.stack([mean_from(k * PERIOD + delay) for k in K], axis=-1)
    torque = align(u, "averaged", delay)
    for k in K[INNER][::37]:
        start = (k - 0.5) * PERIOD
        np.testing.assert_allclose(torque.mean[:, k], mean_from(start), atol=1e-8)  # 7th order again: (5/100)^7
        power = quad_vec(lambda t: qd(t) @ smooth(t), start, start + PERIOD)[0] * FS
        assert power_of(torque, qd(K * PERIOD))[k] == pytest.approx(power, abs=2e-6)  # fourth order: (5/100)^4 / 12


@pytest.mark.parametrize("period", [0.001, 0.004, 0.01])
@pytest.mark.parametrize("delay", [0.0, 0.003])
def test_a_torque_held_by_a_controller_of_another_period_has_its_gain_and_lag(period, delay):
    """A sine that is held for P is, below its images, sin(w P/2) / (w P/2) times itself, P/2 later."""
    w, t = 5.0, K * PERIOD
    channel = TorqueChannel("held", delay, period=period)
    torque = ByChannel().align(np.sin(w * t)[None], channel, FS)
    expected = np.sinc(w * period / 2 / np.pi) * np.sin(w * (t - delay - period / 2))
    np.testing.assert_allclose(torque.mean[0, INNER], expected[INNER], atol=1e-5)


@pytest.mark.parametrize("delay", DELAYS)
def test_an_instantaneous_torque_is_moved_by_its_delay(delay):
    torque = align(smooth(K * PERIOD + delay), "instantaneous", delay)
    np.testing.assert_allclose(torque.mean[:, INNER], smooth(K * PERIOD)[:, INNER], atol=1e-8)
    expected = np.sum(qd(K * PERIOD) * smooth(K * PERIOD), axis=0)
    np.testing.assert_allclose(power_of(torque, qd(K * PERIOD))[INNER], expected[INNER], atol=1e-7)


def test_the_columns_of_an_averaged_torque_are_averaged_over_the_same_window():
    mean = np.stack([quad_vec(smooth, (k - 0.5) * PERIOD, (k + 0.5) * PERIOD)[0] * FS for k in K], axis=-1)
    average = align(smooth(K * PERIOD), "averaged", 0.0).average(smooth(K * PERIOD))
    np.testing.assert_allclose(average[:, INNER], mean[:, INNER], atol=2e-7)  # 17/5760 (5/100)^4 = 2e-8, and its sum


def test_as_logged_ignores_what_the_channel_says(rng):
    u = rng.normal(size=(2, len(K)))
    torque = AsLogged().align(u, TorqueChannel("held", 0.004), FS)
    np.testing.assert_array_equal(torque.mean, u)
    assert torque.halo() == 0
