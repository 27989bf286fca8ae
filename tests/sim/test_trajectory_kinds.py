"""Trajectories of scenarios: ruckig's keep their limits and take no longer than they must; random ones repeat themselves."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from idbench.sim.errors import ScenarioError
from idbench.sim.robot.robot import Robot
from idbench.sim.trajectories import TRAJECTORIES, Fourier, RandomMoves, RandomTimeOptimal, TimeOptimal

POINTS = ((0.0, 0.0), (1.5, -1.0), (1.4, 1.0), (-1.0, 0.9))
FAST = TimeOptimal(POINTS, velocity=(4.0, 5.0), acceleration=(15.0, 20.0), jerk=(200.0, 300.0), rest=0.5)


def test_ruckigs_moves_keep_their_limits_and_reach_one(robot):
    """In every move some joint is at a limit all the time: none is slower than its limits allow."""
    motion = FAST.plan(robot)
    t = np.arange(0, motion.duration, 1e-4)
    reference = motion.at(t, 1e4)
    jerk = np.diff(reference.qdd, axis=0) * 1e4
    for signal, limit in ((reference.qd, FAST.velocity), (reference.qdd, FAST.acceleration)):
        assert (np.abs(signal).max(axis=0) <= np.array(limit) * (1 + 1e-9)).all()
    moving = (t[:-1] > 0.51) & (t[:-1] < motion.duration - 0.51)
    used = np.max(
        [np.abs(reference.qd[:-1]) / FAST.velocity, np.abs(reference.qdd[:-1]) / FAST.acceleration, np.abs(jerk) / FAST.jerk],
        axis=0,
    ).max(axis=1)
    assert np.quantile(used[moving], 0.02) > 0.99


def test_it_rests_at_its_waypoints(robot):
    motion = FAST.plan(robot)
    ends = motion.at(np.array([0.0, 0.4, motion.duration - 0.4, motion.duration + 1.0]), 1.0)
    np.testing.assert_allclose(ends.q, [POINTS[0]] * 2 + [POINTS[-1]] * 2, atol=1e-9)


def test_random_jerk_limited_moves_go_between_the_points_of_fifth_order_ones_within_limits(robot):
    """The same seed draws the same points; with a least time each move takes as long, or longer where its limits ask for it."""
    timed = RandomTimeOptimal(moves=6, acceleration=(10.0,), jerk=(200.0,), duration=1.3, rest=0.5, seed=4)
    fifth = RandomMoves(moves=6, durations=(1.3, 1.3), rest=0.5, seed=4)
    motion, other = timed.plan(robot), fifth.plan(robot)
    assert motion.duration == pytest.approx(other.duration)
    edges = 0.5 + 1.3 * np.arange(7)
    np.testing.assert_allclose(motion.at(edges, 1.0).q, other.at(edges, 1.0).q, atol=1e-9)
    fast = replace(timed, duration=0.0).plan(robot)
    assert fast.duration < motion.duration
    reference = fast.at(np.arange(0, fast.duration, 1e-3), 1e3)
    assert np.abs(reference.qdd).max() == pytest.approx(10.0)
    assert np.abs(reference.qd).max() <= 7.0 + 1e-9


SERIES = Fourier(period=4.0, middle=(0.1, 0.2), sines=((0.3, 0.2), (0.1, -0.1)), cosines=((0.0, 0.1), (0.2, 0.0)), fade=1.0)


@pytest.mark.parametrize(
    "trajectory",
    [FAST, SERIES, Fourier(), replace(Fourier(), repeat=3)],
    ids=["time-optimal", "fading", "at rest", "three times"],
)
def test_a_motion_is_that_of_its_derivatives_and_rests_at_its_ends(robot, trajectory):
    """To what 300 rad/s^3 of jerk, and its steps, leave of a difference."""
    motion, rest = trajectory.plan(robot), trajectory.rest
    t, h = np.linspace(rest + 0.01, motion.duration - rest - 0.01, 997), 1e-6
    before, here, after = (motion.at(t + d, 1.0) for d in (-h, 0.0, h))
    np.testing.assert_allclose((after.q - before.q) / (2 * h), here.qd, atol=1e-7)
    np.testing.assert_allclose(
        (after.qd - before.qd) / (2 * h), here.qdd, atol=2e-4 if trajectory is FAST else 1e-6
    )  # its jerk
    ends = motion.at(np.array([0.0, rest, motion.duration - rest, motion.duration + 1]), 1.0)
    np.testing.assert_allclose(ends.qd, 0.0, atol=1e-9)


def test_a_series_is_its_sum_in_the_middle(robot):
    motion = replace(SERIES, repeat=2).plan(robot)
    t = np.array([0.0, 0.7, 4.3])
    w = 2 * np.pi / 4.0
    one = 0.1 + 0.3 * np.sin(w * t) + 0.1 * np.sin(2 * w * t) + 0.2 * np.cos(2 * w * t)
    np.testing.assert_allclose(motion.at(SERIES.rest + SERIES.fade + t, 1.0).q[:, 0], one)


def test_a_series_that_does_not_rest_must_fade_in():
    with pytest.raises(ScenarioError, match="does not begin at rest: give it a time to fade in"):
        replace(SERIES, fade=0.0)
    with pytest.raises(ScenarioError, match="needs 2 coefficients"):
        replace(SERIES, sines=((0.1,), (0.2,)))
    with pytest.raises(ScenarioError, match="give as many of both"):
        replace(SERIES, sines=((0.1, 0.2),))


def test_it_is_faster_than_fifth_order_moves_under_the_same_limits(robot):
    """Speed and acceleration of a fifth-order move reach 15/8 and 10/sqrt(3) of way over time, and over its square."""
    change = np.abs(np.diff(POINTS, axis=0))
    quintic = np.maximum(15 / 8 * change / FAST.velocity, np.sqrt(10 / np.sqrt(3) * change / FAST.acceleration)).max(axis=1)
    assert FAST.plan(robot).duration - 1.0 < quintic.sum()


def test_random_moves_repeat_themselves_and_keep_their_settings(robot):
    moves = RandomMoves(moves=8, durations=(0.3, 1.0), velocity=(3.0, 5.0), clearance=0.5, smallest_move=0.6, rest=1.0, seed=4)
    planned = moves.plan(robot)
    np.testing.assert_array_equal(planned.waypoints, moves.plan(robot).waypoints)
    assert not np.array_equal(planned.waypoints, replace(moves, seed=5).plan(robot).waypoints)
    assert (planned.peak_velocity <= np.array([3.0, 5.0]) * (1 + 1e-12)).all()
    assert (np.abs(planned.waypoints) <= robot.ranges[:, 1] - 0.5).all()
    assert (np.abs(np.diff(planned.waypoints, axis=0)) >= 0.6).all()
    assert (planned.durations >= 0.3).all()
    assert planned.dwells[0] == planned.dwells[-1] == 1.0


def test_a_hand_has_random_moves_too():
    """Sixteen joints that all move a quarter of their range are never drawn together."""
    joint = '<body><joint type="hinge" limited="true" range="-10 20"/><geom size="0.1"/></body>'
    robot = Robot("hand", mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{16 * joint}</worldbody></mujoco>"))
    points = RandomMoves(moves=3).plan(robot).waypoints
    assert (np.abs(np.diff(points, axis=0)) >= np.radians(30) / 4).all()
    assert (points > np.radians(-10)).all()
    assert (points < np.radians(20)).all()


@pytest.mark.parametrize("name", TRAJECTORIES.builtin)
def test_every_kind_has_defaults_that_the_scara_can_follow(name, robot):
    assert len(TRAJECTORIES.create(name).sample(robot, 100.0).q) > 100
