"""Designed motions: criteria and their slopes, shapes that rest, sigmas that come true."""

from dataclasses import replace

import numpy as np
import pytest
import scipy

from idbench.identify import (
    CHAINS,
    ExplicitModel,
    GeneralizedLeastSquares,
    MotionLog,
    NoiseLevels,
    TorqueChannel,
    identify,
    scara,
)
from idbench.identify.data.kinematics import Limits
from idbench.identify.design.criteria import CRITERIA, LogSigma, sigmas_of
from idbench.identify.design.information import Information, predicted_information
from idbench.identify.design.plan import Plan
from idbench.identify.design.search import DesignSearch, Greedy
from idbench.identify.design.shapes import Shapes

X = np.array([3.5, 0.05, 0.5, 0.06, 0.12, 0.005, 0.01, 0.1])
LEVELS = NoiseLevels(np.array([0.05, 0.02]), np.array([2e-5, 4e-5]))
INERTIA = np.array([[3.6, 0.1], [0.1, 0.06]])
LIMITS = Limits([[-2.4, 2.4], [-2.2, 2.0]], [7, 7], [18, 25], np.inf, [400, 30], [300, np.inf])
T = 6.0


def plan_of(basis=None, criterion=None, **settings):
    t = (np.arange(72) + 0.5) * T / 72
    information = Information(basis or scara(), LEVELS, INERTIA, 100.0, 12.0, 5.0)
    shapes = [Shapes.fourier(at, T, 5) for at in (t, np.linspace(0, T, 288, endpoint=False))]
    p = len(information.basis.names)
    return Plan(information, criterion or CRITERIA["determinant"], LIMITS, *shapes, X, np.zeros((p, p)), **settings)


def random_coefficients(plan, seed=0, size=2.0):
    return size * np.random.default_rng(seed).standard_normal((plan.states.count, 2))


@pytest.mark.parametrize("criterion", [*CRITERIA.values(), LogSigma((0.1, 0.3, 0.2, 0.4))], ids=str)
def test_slopes_of_criteria_are_their_derivatives(criterion):
    rng = np.random.default_rng(0)
    A, D = rng.standard_normal((20, 4)), rng.standard_normal((4, 4))
    M, D, h = A.T @ A, D + D.T, 1e-6
    change = (criterion.value(M + h * D) - criterion.value(M - h * D)) / (2 * h)
    assert np.trace(criterion.slope(M) @ D) == pytest.approx(change, rel=1e-6)


@pytest.mark.parametrize("name", CRITERIA)
def test_only_the_determinant_does_not_mind_units(name):
    """Of which of two motions it prefers; a parameter in other units scales a column."""
    rng, differ = np.random.default_rng(1), 0
    for _ in range(50):
        A, B = rng.standard_normal((2, 30, 3)) * rng.uniform(0.2, 2.0, (2, 1, 3))
        scale = np.diag([1.0, 1000.0, 0.01])
        value = CRITERIA[name].value
        before = value(A.T @ A) < value(B.T @ B)
        after = value(scale @ A.T @ A @ scale) < value(scale @ B.T @ B @ scale)
        differ += bool(before != after)
    assert (differ == 0) == (name == "determinant")


@pytest.mark.parametrize("limited", [False, True], ids=["free", "beyond limits of torques"])
@pytest.mark.parametrize("criterion", [CRITERIA["determinant"], LogSigma((0.125,) * 8)], ids=["determinant", "sigma"])
def test_the_slope_of_a_plan_is_its_derivative(criterion, limited):
    """To six digits, which is what steps of 1e-6 leave; torques beyond their limits included."""
    limits = replace(LIMITS, torque=np.array([20.0, 1.0]), rms_torque=np.array([5.0, 0.3])) if limited else LIMITS
    plan = replace(plan_of(criterion=criterion), limits=limits, home=np.array([0.5, -0.5]))
    c, h = random_coefficients(plan), 1e-5
    assert (plan.excess(c) > 0) == limited
    direction = plan.value(c)[1] + 0.1 * np.random.default_rng(3).standard_normal(c.shape)
    direction /= np.linalg.norm(direction)
    change = (plan.value(c + h * direction)[0] - plan.value(c - h * direction)[0]) / (2 * h)
    assert np.sum(plan.value(c)[1] * direction) == pytest.approx(change, rel=1e-5)


def test_motions_keep_linear_limits_whatever_the_coefficients():
    plan = plan_of()
    fine = Shapes.fourier(np.linspace(0, T, 6000), T, 5)
    for seed, size in enumerate((0.1, 1.0, 30.0, 1e4)):
        motion = fine.at(plan.coefficients(random_coefficients(plan, seed, size)))
        motion[0] += LIMITS.middle
        assert (motion[0] >= LIMITS.position[:, 0]).all()
        assert (motion[0] <= LIMITS.position[:, 1]).all()
        assert (np.abs(motion[1]) <= LIMITS.velocity).all()
        assert (np.abs(motion[2]) <= LIMITS.acceleration).all()


def test_series_are_those_of_their_sines_and_cosines():
    t, c = np.linspace(0, T, 50), random_coefficients(plan_of())
    mean, sines, cosines = Shapes.series(c, T)
    phase = 2 * np.pi * np.arange(1, 6) * t[:, None] / T
    np.testing.assert_allclose(Shapes.fourier(t, T, 5).at(c)[0], mean + np.sin(phase) @ sines + np.cos(phase) @ cosines)


def test_search_finds_far_better_than_random_and_survives_an_interruption():
    plan = plan_of()
    starts = [random_coefficients(plan, seed) for seed in range(4)]
    random = min(plan.value(c)[0] for c in starts)
    search = DesignSearch(starts, 160)
    search.run(plan, 4, 40)
    assert plan.value(search.best)[0] < random - 0.3
    costs = [plan.value(c)[0] for c in search.found]
    assert costs == sorted(costs)

    def stop(share):
        if share > 0.1:
            raise KeyboardInterrupt

    stopped = DesignSearch(starts, 160, stop)
    stopped.run(plan, 4, 40)
    assert stopped.interrupted
    assert plan.value(stopped.best)[0] < random


def test_greedy_moves_tell_more_than_random_ones():
    plan = replace(plan_of(), states=Shapes.moves((np.arange(72) + 0.5) * T / 72, T, 6))
    plan = replace(plan, instants=Shapes.moves(np.linspace(0, T, 288, endpoint=False), T, 6))
    greedy, rng = Greedy(plan.information, LIMITS, 1.0, plan.known), np.random.default_rng(0)
    chosen = [plan.value(greedy.waypoints(rng, 6))[0] for _ in range(5)]
    drawn = [plan.value(random_coefficients(plan, seed))[0] for seed in range(20)]
    assert max(chosen) < np.median(drawn)


@pytest.mark.thorough
@pytest.mark.parametrize("position", [0.0, 1e-4], ids=["torque noise", "torque and position noise"])
def test_estimates_scatter_as_predicted(position):
    """Errors of 400 logs of one motion, by generalized least squares; the scatter of a variance is 7 %, its sigma's 3.5 %."""
    plan, fs, runs = plan_of(), 100.0, 400
    t = np.arange(0, T, 1 / fs)
    motion = Shapes.fourier(t, T, 5).at(plan.coefficients(random_coefficients(plan)))
    motion = np.concatenate([motion[:, :1].repeat(100, 1), motion, motion[:, :1].repeat(100, 1)], axis=1)
    motion[0] += LIMITS.middle
    tau = plan.information.columns(motion) @ X
    levels = NoiseLevels(np.array([0.05, 0.02]), np.full(2, position))
    channel = TorqueChannel("instantaneous")
    rng = np.random.default_rng(0)
    noisy = [x + s * rng.standard_normal((runs, *x.shape)) for x, s in ((motion[0], position), (tau, levels.torque))]
    found = identify(MotionLog(fs, *noisy, channel), scara(), ExplicitModel(), estimator=GeneralizedLeastSquares())
    log = MotionLog(fs, motion[0], tau, channel)
    sigma = np.sqrt(np.diag(np.linalg.inv(predicted_information(log, scara(), X, levels, CHAINS.create("idbench")))))
    rms = np.sqrt(np.mean((found.X - X) ** 2, axis=0))
    np.testing.assert_allclose(rms / sigma, 1.0, atol=0.15)
    assert np.exp(np.log(rms / sigma).mean()) == pytest.approx(1.0, abs=0.06)


def test_the_quick_information_ranks_motions_as_the_exact_one():
    """Typical sigmas of forty motions: one inertia for all postures, and few states, hardly change their order."""
    plan, exact, quick = plan_of(), [], []
    criterion, t = LogSigma((0.125,) * 8), np.arange(0, T, 0.01)
    for seed in range(40):
        c = random_coefficients(plan, seed, 3.0)
        q = Shapes.fourier(t, T, 5).at(plan.coefficients(c))[0] + LIMITS.middle
        q = np.concatenate([q[:1].repeat(100, 0), q, q[:1].repeat(100, 0)])
        log = MotionLog(100.0, q, np.zeros_like(q), TorqueChannel("held"))
        exact.append(float(criterion.value(predicted_information(log, scara(), X, LEVELS, CHAINS.create("idbench")))))
        quick.append(float(criterion.value(plan.matrix(plan.motion(c)))))
    assert scipy.stats.spearmanr(exact, quick).statistic > 0.95


def test_sigmas_of_what_is_not_told_are_infinite():
    M = np.diag([4.0, 0.0, 1e6])
    np.testing.assert_allclose(sigmas_of(M), [0.5, np.inf, 1e-3])
