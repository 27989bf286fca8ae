"""Gains of torques that a log shows together: their ratios, their signs, and with something held their size."""

import numpy as np
import pytest
from builders import arm

from idbench.identify import ESTIMATORS, MODELS, MotionLog, Problem, TorqueChannel, estimate, idbench_chain
from idbench.identify.basis.basis import Basis
from idbench.identify.judge.diagnosis import diagnosed
from idbench.identify.judge.torque_gains import TorqueGains
from idbench.sim.robot.inverse_dynamics import inverse_dynamics

T = np.arange(2400) / 100


@pytest.fixture(scope="module")
def made():
    """Returns the problem of a PUMA's log with gains, torques with 1 % of noise, some links held."""
    robot = arm("puma560")
    rng = np.random.default_rng(3)
    w = 2 * np.pi * 0.1 * np.arange(1, 6)[:, None, None]
    a, b = rng.standard_normal((2, 5, 6, 1)) / np.arange(1, 6)[:, None, None]
    q, qd, qdd = (
        0.5 * np.sum(x, axis=0).T
        for x in (
            a * np.sin(w * T) + b * np.cos(w * T),
            w * (a * np.cos(w * T) - b * np.sin(w * T)),
            -(w**2) * (a * np.sin(w * T) + b * np.cos(w * T)),
        )
    )
    model = robot.robot.model
    tau = inverse_dynamics(robot.robot, q, qd, qdd) + model.dof_frictionloss * np.sign(qd)
    tau += 0.01 * np.std(tau, axis=0) * rng.standard_normal(tau.shape)

    def problem(gains, basis: Basis | None = None):
        log = MotionLog(100.0, q, tau * gains, TorqueChannel("instantaneous"))
        return Problem((log,), basis or robot.grouping.basis, MODELS.create("explicit"), idbench_chain())

    return problem


def test_without_a_wrong_gain_there_is_none(made):
    assert TorqueGains.of(made(np.ones(6))).choices() == []


@pytest.mark.parametrize(
    ("joint", "gain"), [(0, 2.0), (1, 1000.0), (2, -1.0), (1, 0.2), (0, -0.5)], ids=["twice", "mN m", "sign", "A", "both"]
)
def test_the_odd_one_out_is_found_with_its_size(made, joint, gain):
    gains = np.where(np.arange(6) == joint, gain, 1.0)
    (found,) = TorqueGains.of(made(gains)).choices()
    np.testing.assert_allclose(found, gains, rtol=0.02)  # a hundredth of noise in some 200 rows that are independent


def test_what_multiplies_all_torques_is_seen_by_nobody(made):
    """But for their sign, which inertias have. Of the wrist, which carries little of others, the gain is not known."""
    assert TorqueGains.of(made(np.full(6, 1.3))).choices() == []
    (found,) = TorqueGains.of(made(-np.ones(6))).choices()
    np.testing.assert_array_equal(found, [-1, -1, -1, 1, 1, 1])


def test_with_links_held_their_size_is_known(made):
    robot = arm("puma560")
    values = dict(zip(robot.grouping.standard.names, robot.X.tolist(), strict=True))
    held = {p.name: values[p.name] for p in robot.grouping.standard.parameters if p.symbol in ("M", "MX", "MY", "MZ")}
    basis = robot.grouping.standard.holding(**held)
    shown = Problem((made(np.ones(6)).logs[0],), basis, MODELS.create("explicit"), idbench_chain())
    basis = basis.without(*shown.factors.together.hidden())
    (found,) = TorqueGains.of(made(np.full(6, 1.3), basis)).choices()
    np.testing.assert_allclose(found[:3], 1.3, rtol=0.02)


@pytest.mark.thorough
def test_a_gain_that_a_log_would_not_show_is_not_named_and_one_that_it_would_is(made):
    """At half and twice of what it says it would hide."""
    hidden = TorqueGains.of(made(np.ones(6))).hidden
    assert (hidden[:3] < 0.1).all()
    for share, named in ((0.5, False), (2.0, True)):
        problem = made(np.where(np.arange(6) == 2, 1 + share * hidden[2], 1.0))
        found = diagnosed(problem, estimate(problem, ESTIMATORS.create("GLS")).X)
        assert any((one.cause, one.joint) == ("gain", 2) for one in found) == named
