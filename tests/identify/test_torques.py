"""Alignment against closed-form integrals of a held, an averaged and a delayed torque."""

import itertools

import numpy as np
import pytest
from scipy.integrate import quad_vec

from identify import AsLogged, ByChannel, TorqueChannel

FS = 100.0
PERIOD = 1 / FS
K = np.arange(400)
INNER = slice(20, -20)
DELAYS = [0.0, 0.003, 0.005, 0.007, 0.0149, -0.002]


def q(t):
    return np.stack([np.sin(3 * t), np.cos(2 * t) + 0.3 * t])


def qd(t):
    return np.stack([3 * np.cos(3 * t), -2 * np.sin(2 * t) + 0.3])


def smooth(t):
    return np.stack([np.sin(5 * t + 1), np.cos(4 * t)])


def align(tau, meaning, delay):
    return ByChannel().align(tau, TorqueChannel(meaning, delay), FS)


@pytest.mark.parametrize("delay", DELAYS)
def test_a_held_torque_has_its_exact_mean_and_work(delay, rng):
    """Against a hold that is integrated piece by piece on a fine grid, whatever the samples are."""
    u = rng.normal(size=(2, len(K)))
    torque = align(u, "held", delay)
    for k in K[INNER][::37]:
        start, end = (k - 0.5) * PERIOD, (k + 0.5) * PERIOD
        edges = np.unique(np.clip([start, *(np.arange(k - 4, k + 4) * PERIOD + delay), end], start, end))
        held = [int(np.floor((0.5 * (a + b) - delay) * FS + 1e-9)) for a, b in itertools.pairwise(edges)]
        mean = sum(u[:, i] * (b - a) for i, a, b in zip(held, edges, edges[1:], strict=False)) * FS
        work = sum(u[:, i] @ (q(b) - q(a)) for i, a, b in zip(held, edges, edges[1:], strict=False)) * FS
        np.testing.assert_allclose(torque.mean()[:, k], mean, atol=1e-12)
        power = torque.power(q(K * PERIOD), qd(K * PERIOD))[0, k]
        assert power == pytest.approx(work, abs=1e-9)  # q between samples is interpolated to 7th order: (3/100)^7


@pytest.mark.parametrize("delay", DELAYS)
def test_an_averaged_torque_has_its_mean_and_power(delay):
    def mean_from(t):
        return quad_vec(smooth, t, t + PERIOD)[0] * FS

    u = np.stack([mean_from(k * PERIOD + delay) for k in K], axis=-1)
    torque = align(u, "averaged", delay)
    for k in K[INNER][::37]:
        start = (k - 0.5) * PERIOD
        np.testing.assert_allclose(torque.mean()[:, k], mean_from(start), atol=1e-8)  # 7th order again: (5/100)^7
        power = quad_vec(lambda t: qd(t) @ smooth(t), start, start + PERIOD)[0] * FS
        assert torque.power(q(K * PERIOD), qd(K * PERIOD))[0, k] == pytest.approx(
            power, abs=2e-6
        )  # fourth order: (5/100)^4 / 12


@pytest.mark.parametrize("delay", DELAYS)
def test_an_instantaneous_torque_is_moved_by_its_delay(delay):
    torque = align(smooth(K * PERIOD + delay), "instantaneous", delay)
    np.testing.assert_allclose(torque.mean()[:, INNER], smooth(K * PERIOD)[:, INNER], atol=1e-8)
    expected = np.sum(qd(K * PERIOD) * smooth(K * PERIOD), axis=0)
    np.testing.assert_allclose(torque.power(q(K * PERIOD), qd(K * PERIOD))[0, INNER], expected[INNER], atol=1e-7)


@pytest.mark.parametrize("meaning", ["held", "averaged"])
def test_columns_are_averaged_over_the_same_window(meaning):
    mean = np.stack([quad_vec(smooth, (k - 0.5) * PERIOD, (k + 0.5) * PERIOD)[0] * FS for k in K], axis=-1)
    average = align(smooth(K * PERIOD), meaning, 0.0).average(smooth(K * PERIOD))
    np.testing.assert_allclose(average[:, INNER], mean[:, INNER], atol=2e-7)  # 17/5760 (5/100)^4 = 2e-8, and its sum


def test_as_logged_ignores_what_the_channel_says(rng):
    u = rng.normal(size=(2, len(K)))
    torque = AsLogged().align(u, TorqueChannel("held", 0.004), FS)
    np.testing.assert_array_equal(torque.mean(), u)
    assert torque.halo() == 0
