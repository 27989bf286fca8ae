"""Offsets of the joints of an arm that depend on each other."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from builders import pendulum

from idbench.identify.servo import Servo, ServoFit, ServoRun
from idbench.identify.servo.closed_loop import ServoLoop
from idbench.identify.servo.identification import OffsetJoint, together
from idbench.identify.servo.parameters import SERVO_PARAMETERS
from idbench.identify.servo.search import Found

RNG = np.random.default_rng(0)
FREE = ("a", "offset", "lead")
PLACE = FREE.index("offset")


def fit_of(covariance, free=FREE):
    p = dict(zip(FREE, [10.0, 0.0, 0.0] + 0.2 * RNG.normal(size=3), strict=True))  # far from all limits
    found = Found(p, 0.0, None, None, None, None)
    loop = SimpleNamespace(
        limits=lambda names: np.array([[SERVO_PARAMETERS[x].low, SERVO_PARAMETERS[x].high] for x in names]).T
    )
    return ServoFit("coulomb", free, found, loop, None, (np.inf, np.inf), covariance)


def covariance(n=3):
    root = RNG.normal(size=(n, n))
    return root @ root.T


@pytest.fixture
def three():
    """Return three joints whose fits depend on each other's offsets, the last without one of its own."""
    fits = [fit_of(covariance()), fit_of(covariance()), fit_of(covariance(2), ("a", "lead"))]
    return {
        j: OffsetJoint(fit, {k: 0.4 * RNG.normal(size=len(fit.free)) for k in (0, 1) if k != j}) for j, fit in enumerate(fits)
    }


def whole(joints):
    """Return what parameters of all joints do to each other, shape (8, 8), a matrix for each pair of joints side by side."""
    starts = np.cumsum([0] + [len(joint.fit.free) for joint in joints.values()])
    K = np.zeros((starts[-1], starts[-1]))
    for j, joint in joints.items():
        for k, column in joint.per_offset.items():
            K[starts[j] : starts[j + 1], starts[k] + PLACE] = column
    return K, starts


def test_offsets_agree_and_covariances_are_those_of_the_whole_system(three):
    assumed = {0: 0.3, 1: -0.2}
    found = together(three, assumed)
    K, starts = whole(three)
    through = np.linalg.inv(np.eye(len(K)) - K)
    alone = np.concatenate([[joint.fit.p[name] for name in joint.fit.free] for joint in three.values()])
    at = np.zeros(len(K))
    at[[starts[k] + PLACE for k in assumed]] = list(assumed.values())
    all_of = through @ (alone - K @ at)  # x = alone + K (x - at)
    C = np.zeros_like(K)
    for j, joint in three.items():
        C[starts[j] : starts[j + 1], starts[j] : starts[j + 1]] = joint.fit.covariance
    C = through @ C @ through.T
    for j, fit in found.items():
        some = slice(starts[j], starts[j + 1])
        np.testing.assert_allclose([fit.p[name] for name in fit.free], all_of[some], rtol=1e-12)
        np.testing.assert_allclose(fit.covariance, C[some, some], rtol=1e-12, atol=1e-12)
    assert found[2].p["offset"] == three[2].fit.p["offset"]  # held, or without effect


def test_joints_without_an_effect_on_each_other_stay(three):
    apart = {j: OffsetJoint(joint.fit, {}) for j, joint in three.items()}
    for assumed in ({}, {0: 0.3, 1: -0.2}):
        found = together(apart, assumed)
        assert {j: fit.p for j, fit in found.items()} == {j: joint.fit.p for j, joint in three.items()}
        for j, fit in found.items():
            np.testing.assert_allclose(fit.covariance, three[j].fit.covariance)


def test_an_offset_that_is_held_has_no_error(three):
    held = {**three, 0: OffsetJoint(replace(fit_of(covariance(2)), free=("a", "lead")), {1: np.array([0.1, 0.2])})}
    found = together(held, {0: 0.3, 1: -0.2})
    alone, other = three[1].fit, found[1]
    np.testing.assert_allclose(other.covariance, alone.covariance)  # nothing comes back to it
    assert other.p == alone.p


def test_offsets_that_gravity_does_not_tell_apart_stay_as_they_are():
    """Two parallel axes, all of the weight behind the second: only the sum of their offsets is known."""
    B = {0: np.array([0.0, -0.9999, 0.0]), 1: np.array([0.0, -1.0, 0.0])}
    pair = {j: OffsetJoint(fit_of(covariance()), {1 - j: B[j]}) for j in (0, 1)}
    found = together(pair, {0: 0.1, 1: -0.1})
    assert {j: fit.p for j, fit in found.items()} == {j: joint.fit.p for j, joint in pair.items()}


def test_parameters_stay_within_their_limits():
    one, other = fit_of(covariance()), fit_of(covariance())
    found = together(
        {0: OffsetJoint(one, {1: np.array([-1e3, 0.0, 0.0])}), 1: OffsetJoint(other, {})}, {1: other.p["offset"] - 0.5}
    )
    assert found[0].p["a"] == 0


def test_offsets_that_agree_stay_within_the_range_of_the_joint():
    """Its encoder spans 2 rad of a range of 2.2 rad: an offset of more than 0.1 rad is beyond a stop."""
    t = np.arange(100) / 100
    q = np.cos(2 * np.pi * t)
    run = ServoRun(t, q, q, pendulum(0.5, 0.1), Servo(), range=(-1.1, 1.1))
    one, other = replace(fit_of(covariance()), loop=ServoLoop([run], 1e-3)), fit_of(covariance())
    pair = {0: OffsetJoint(one, {1: np.array([0.0, 1.0, 0.0])}), 1: OffsetJoint(other, {})}
    for way in (-5.0, 5.0):
        found = together(pair, {1: other.p["offset"] - way})
        assert found[0].p["offset"] == pytest.approx(0.1 * np.sign(way))


def test_an_offset_follows_from_gravity_and_is_none_where_torques_have_no_scale():
    """Unless it is held."""
    one = fit_of(covariance())
    found = replace(one.found, residual=RNG.normal(size=(1, 100)))
    loop, shown = SimpleNamespace(runs=[None], samples=100), SimpleNamespace(loaded=True)
    scaled, fit = (replace(one, found=found, loop=loop, excitation=shown, contrasts=(x, x)) for x in (np.inf, 1.0))
    assert scaled.offset == one.p["offset"] != 0
    assert scaled.unscaled == set()
    assert fit.offset == 0
    assert fit.unscaled == {"a", "offset"}
    assert replace(fit, free=("a", "lead")).offset == one.p["offset"]
