"""A test of lack of fit: rare where the model is right, sure where it is not, and it names what the torque depends on."""

from dataclasses import replace

import numpy as np
import pytest

from idbench.identify import CHAINS, ESTIMATORS, ExplicitModel, IdentificationError, MotionLog, Problem, scara
from idbench.identify.judge.lack_of_fit import WRONG, lack_of_fit
from idbench.sim.engine.simulation import simulate
from idbench.sim.scenario.scenario_file import load
from idbench.sim.trajectories import RandomMoves

NOISE, BITS16 = np.array([0.05, 0.005]), 2 * np.pi / 2**16 / np.sqrt(12)


@pytest.fixture(scope="module")
def exact():
    moves = RandomMoves(moves=12, durations=(1.3, 1.3), rest=0.1, seed=3)
    return simulate(replace(load("ideal"), trajectory=moves), range(1)).alone()


def found(exact, seed, more=0.0, noise=NOISE):
    rng = np.random.default_rng(seed)
    tau = exact.tau + more + noise * rng.standard_normal(exact.tau.shape)
    q = exact.q + BITS16 * rng.standard_normal(exact.q.shape)
    problem = Problem((MotionLog(exact.fs, q, tau, exact.torque),), scara(), ExplicitModel(), CHAINS.create("idbench"))
    return lack_of_fit(problem, ESTIMATORS.create("GLS").solve(problem).X)


@pytest.mark.thorough
@pytest.mark.parametrize("noise", [NOISE, 10 * NOISE])
def test_p_values_of_the_right_model_are_what_they_say(exact, noise):
    """Of 60: within four standard deviations of a binomial number; one below 1e-3 comes in one of sixteen such tests."""
    p = np.array([found(exact, seed, noise=noise)[0].p for seed in range(60)])
    for level in (0.01, 0.05, 0.2):
        assert np.count_nonzero(p < level) < 60 * level + 4 * np.sqrt(60 * level)
    assert p.min() > WRONG / 10
    assert np.count_nonzero(p < 0.9) > 10  # and not always 1


@pytest.mark.parametrize("over", ["velocity", "position", "load", "time"])
def test_what_torques_hang_on_is_named(exact, over):
    """Of the second joint, a tenth of its rms torque: the surest is that joint, over that."""
    signals = CHAINS.create("idbench").signals(exact)
    q, qd, level = signals.state.q[1], signals.state.qd[1], np.sqrt(np.mean(exact.tau[:, 1] ** 2))
    sign, t = np.sign(qd), np.linspace(0, 1, len(q))
    what = {
        "velocity": sign * np.exp(-np.abs(qd) / 0.4),
        "position": np.sin(5 * q),
        "load": sign * np.abs(exact.tau[:, 1]) / level,
        "time": sign * (t - 0.5),
    }[over]
    first = found(exact, 0, more=0.1 * level * np.stack([0 * what, what], axis=1))[0]
    assert (first.joint, first.over) == (1, over)
    assert first.p < 1e-6
    assert 0.1 < first.size / (0.1 * level * what.std()) < 1.1  # as much as friction and bodies do not take


def test_exact_logs_lack_nothing(exact):
    """What differences and rounding leave is no lack of fit."""
    assert found(exact, 0, noise=0.0)[0].p > WRONG


def test_too_short_a_log_is_not_tested(exact):
    short = exact.part(0, round(1.5 * exact.fs))
    with pytest.raises(IdentificationError, match=r"too few|do not determine"):
        found(short, 0)


def test_a_robot_at_rest_cannot_be_tested(exact):
    """Its positions do not change: the covariance of its rows has no size."""
    still = MotionLog(exact.fs, np.zeros((500, 2)), np.zeros((500, 2)), exact.torque)
    problem = Problem((still,), scara(), ExplicitModel(), CHAINS.create("idbench"))
    with pytest.raises(IdentificationError, match=r"residuals cannot be tested"):
        lack_of_fit(problem, np.zeros(len(scara().names)))
