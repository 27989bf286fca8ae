"""Motion and parameters together."""

from dataclasses import replace

import numpy as np
import pytest
from builders import SOLVED, noisy

from idbench.identify import (
    MODELS,
    GeneralizedLeastSquares,
    IdentificationError,
    MaximumLikelihood,
    MotionLog,
    NoPrefilter,
    ReversalMask,
    TorqueChannel,
    WeightedLeastSquares,
    attempt_each,
    identify,
    scara,
    smoothed_log,
    smoothed_motion,
)
from idbench.identify.estimators.likelihood import maximum_likelihood
from idbench.identify.estimators.likelihood.cells import GAUSS, Cells, hermite
from idbench.identify.estimators.likelihood.normal_equations import Noise, NormalEquations
from idbench.identify.estimators.likelihood.reversals import Turns
from idbench.identify.estimators.problem import Problem
from idbench.identify.rows.chain import idbench_chain
from idbench.sim.engine.simulation import simulate
from idbench.sim.scenario.scenario_file import load
from idbench.sim.trajectories import RandomMoves

EXPLICIT, ML, GLS = MODELS.create("explicit"), MaximumLikelihood(), GeneralizedLeastSquares()
BITS16 = 2 * np.pi / 2**16 / np.sqrt(12)
RUNS = 12


def scenario(**changes):
    moves = RandomMoves(moves=12, durations=(1.3, 1.3), rest=0.7, seed=3)
    return replace(load("ideal"), trajectory=moves, **changes)


def run(log, k):
    """Return one run of several."""
    return MotionLog(log.fs, log.q[k], log.tau[k], log.torque)


@pytest.fixture(scope="module")
def exact():
    """A held command, exact positions, of 12 motions."""
    base = scenario()
    motions = [replace(base.trajectory, seed=100 + i).sample(base.real_robot, base.fs) for i in range(RUNS)]
    return simulate(base, range(RUNS), motions=motions).log


def test_cubic_polynomials_are_those_of_their_ends():
    """q = t^3 - 2 t of a cell of 0.1 s, with its derivatives, anywhere."""
    T, s = 0.1, np.linspace(0, 1, 7)
    ends = np.array([0.0, -2.0, T**3 - 2 * T, 3 * T**2 - 2])
    t = s * T
    for weights, wanted in zip(hermite(s, T), (t**3 - 2 * t, 3 * t**2 - 2, 6 * t), strict=True):
        np.testing.assert_allclose(ends @ weights, wanted, atol=1e-12)


@pytest.mark.parametrize("meaning", ["held", "averaged", "instantaneous"])
def test_torque_in_a_cell_is_what_its_samples_mean(meaning):
    """Of tau = t^2 + 3 t, logged late by 4 ms: mean and half the difference at the Gauss points; held torques are steps."""
    fs, delay, t = 100.0, 0.004, np.arange(200) / 100.0
    channel = TorqueChannel(meaning, delay)
    begin = t + delay
    mean = ((begin + 0.01) ** 3 - begin**3) / 0.03 + 3 * (begin + 0.005)
    tau = mean if meaning == "averaged" else begin**2 + 3 * begin
    cells = Cells.of(MotionLog(fs, np.zeros((200, 1)), tau[:, None], channel))
    points = [begin + s * 0.01 for s in GAUSS]
    first, second = (x**2 + 3 * x for x in points)
    found = [x[0] for x in cells.torque]
    inner = slice(3, cells.count - 3)
    wanted = (tau, 0 * tau) if meaning == "held" else ((first + second) / 2, (second - first) / 2)
    for x, y in zip(found, wanted, strict=True):
        np.testing.assert_allclose(x[inner], y[: cells.count][inner], atol=1e-7)


@pytest.mark.thorough
def test_the_right_hand_side_is_the_slope_of_the_cost(exact, truth):
    """By central differences of the cost, in X and in the motion, where friction does not jump."""
    log = noisy(exact, BITS16, 0.01).part(0, 200)
    cells = Cells.of(MotionLog(log.fs, log.q[0], log.tau[0], log.torque))
    t = np.arange(201)[:, None] / log.fs
    z = np.stack([np.sin(t + [0.3, 0.7]) + 2 * t, np.cos(t + [0.3, 0.7]) + 2], axis=1)
    one = np.ones((2, cells.count))
    near = np.where(np.arange(cells.count + 1) % 3, np.inf, 0.2)[:, None] + np.zeros(2)
    turns = Turns.none((2, cells.count))
    noise = Noise(0.1 * one, 0.2 * one, np.full(2, 1e-3), one > 0, near, z[:, 1] + 0.1, turns)

    def cost(X, z):
        return NormalEquations.of(cells, scara(), X, z, noise).cost

    found = NormalEquations.of(cells, scara(), truth, z, noise)
    for k in range(8):
        step = 1e-4 * np.eye(8)[k]
        slope = (cost(truth + step, z) - cost(truth - step, z)) / 2e-4
        assert -2 * found.b_parameters[k, 0] == pytest.approx(slope, rel=1e-5)
    for index in ((0, 0, 0), (57, 1, 0), (57, 0, 1), (200, 1, 1)):
        step = np.zeros_like(z)
        step[index] = 1e-6
        slope = (cost(truth, z + step) - cost(truth, z - step)) / 2e-6
        # To what slopes at a cell's middle, from velocities of difference 0.05 rad/s, leave.
        assert -2 * found.b_nodes.reshape(*z.shape, -1)[(*index, 0)] == pytest.approx(slope, rel=2e-2)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("position", "torque", "most"), [(BITS16, 0.0, 0.25), (16 * BITS16, 0.0, 0.2), (BITS16, 0.01, 0.9), (BITS16, 0.1, 1.1)]
)
def test_errors_against_weighted_least_squares(position, torque, most, exact, truth):
    """Typical errors of 12 motions, each known to a fifth, and sigma: the table of docs/noise.md has 64."""
    log = noisy(exact, position, torque)
    weighted, likely = (identify(log, scara(), EXPLICIT, estimator=each) for each in (WeightedLeastSquares(), ML))
    error, other = (np.sqrt(np.mean((found.X - truth) ** 2, axis=0)) for found in (likely, weighted))
    assert np.exp(np.mean(np.log(error / other))) < most
    z = (likely.X - truth) / likely.calibrated_sigma
    assert np.sqrt(np.mean(z**2)) == pytest.approx(1, abs=0.25)


@pytest.mark.thorough
@pytest.mark.parametrize("coulomb", [(20.0, 10.0), (60.0, 15.0)])
def test_friction_a_hundred_times_larger_than_what_moves_a_joint(coulomb, truth):
    """As of geared arms: where its sign is not known, velocities would swing between the counts, and no fit converge."""
    made = scenario(friction=replace(load("ideal").friction, coulomb=coulomb))
    log = simulate(made).alone()
    log = noisy(log, BITS16, [3.0, 0.5], rng=0)
    found, true = identify(log, scara(), EXPLICIT, estimator=ML), truth.copy()
    true[[2, 7]] = coulomb
    assert (np.abs(found.X - true) < 4 * found.own_sigma).all()
    np.testing.assert_allclose(found.noise_levels.torque, [3.0, 0.5], rtol=0.1)


@pytest.mark.thorough
@pytest.mark.parametrize("delay", [0.003, 0.012])
def test_a_stated_delay_is_taken_into_account(delay, truth):
    made = scenario(timing=replace(load("ideal").timing, delay=delay))
    log = simulate(made).alone()
    found = identify(noisy(log, BITS16, 0.0), scara(), EXPLICIT, estimator=ML)
    assert (np.abs(found.X - truth) < 5 * found.own_sigma).all()


def test_two_logs_are_worth_two(exact):
    one, two = (noisy(run(exact, k), BITS16, 0.02) for k in (0, 1))
    both = identify([one, two], scara(), EXPLICIT, estimator=ML)
    alone = [identify(log, scara(), EXPLICIT, estimator=ML) for log in (one, two)]
    together = 1 / np.sqrt(sum(1 / found.own_sigma**2 for found in alone))
    np.testing.assert_allclose(both.own_sigma, together, rtol=0.25)


def test_other_models_are_refused_and_leave_the_explicit_one(exact):
    problem = Problem((noisy(run(exact, 0), BITS16, 0.0),), scara(), EXPLICIT, idbench_chain())
    found = attempt_each(problem, {name: MODELS.create(name) for name in SOLVED}, ML)
    assert found["explicit"].X.shape == (8,)
    assert "--model explicit, or GLS" in str(found["power"])


def test_logs_too_long_for_their_motion_are_refused(exact, monkeypatch):
    monkeypatch.setattr(maximum_likelihood, "MAX_BYTES", 1e6)
    with pytest.raises(IdentificationError, match=r"together take .* GB: use GLS, or at most \d+ samples"):
        identify(run(exact, 0), scara(), EXPLICIT, estimator=ML)


def test_the_smoothed_motion_is_true_within_its_sigma(truth):
    """Positions and velocities of a simulated motion, at its samples and between, away from the ends."""
    made = simulate(scenario())
    log = noisy(made.log, BITS16, 0.001)
    estimate = identify(log, scara(), EXPLICIT, estimator=ML)
    motion = smoothed_motion(estimate.fits[(0,)])
    inner, count = slice(20, -20), len(motion.t)
    for found, sigma, true in ((motion.q, motion.sigma_q, made.q[0]), (motion.qd, motion.sigma_qd, made.qd[0])):
        z = ((found - true[:count]) / sigma)[inner]
        assert np.sqrt(np.mean(z**2)) == pytest.approx(1, abs=0.3)
    raw, true = np.gradient(log.q[0], 1 / log.fs, axis=0)[:count], made.qd[0][:count]
    assert np.std((motion.qd - true)[inner, 0]) < 0.8 * np.std((raw - true)[inner, 0])
    between = smoothed_motion(estimate.fits[(0,)], t=np.array([3.003, 3.0071]))
    assert between.q.shape == (2, 2)
    with pytest.raises(IdentificationError, match="instants must lie in 0 to"):
        smoothed_motion(estimate.fits[(0,)], t=np.array([1e3]))


def test_torques_that_do_not_belong_to_the_motion_are_refused(exact):
    """Parameters of zero, with which nothing moves, would explain them as well as any: far off, or not even determined."""
    log = noisy(MotionLog(exact.fs, exact.q[0], np.ones_like(exact.tau[0]), exact.torque), BITS16, 0.0)
    with pytest.raises(IdentificationError, match=r"order and delay of the torques|a joint stands|is not determined"):
        identify(log, scara(), EXPLICIT, estimator=ML)


def test_a_motion_that_nothing_moves_is_refused(exact):
    log = noisy(MotionLog(exact.fs, exact.q[0], np.zeros_like(exact.tau[0]), exact.torque), BITS16, 0.0)
    with pytest.raises(IdentificationError, match=r"the motion is not determined by this log: .*use GLS"):
        identify(log, scara(), EXPLICIT, estimator=ML)


@pytest.mark.thorough
@pytest.mark.parametrize("stated", [0.004, 0.002, 0.007])
def test_the_delay_is_found_with_the_parameters(stated, truth):
    """A true one of 4 ms, from what the log states: to five of its sigmas, which are below 50 us."""
    log = simulate(scenario(timing=replace(load("ideal").timing, delay=0.004))).alone()
    wrong = noisy(MotionLog(log.fs, log.q, log.tau, TorqueChannel("held", stated)), BITS16, 0.01)
    found = identify(wrong, scara(), EXPLICIT, estimator=MaximumLikelihood(find_delay=True))
    fit = found.fits[()]
    sigma = np.sqrt(fit.covariance[-1, -1])
    assert sigma < 5e-5
    assert abs(stated + fit.delay - 0.004) < 5 * sigma
    assert smoothed_log(fit).torque.delay == pytest.approx(stated + fit.delay)
    assert (np.abs(found.X - truth) < 5 * found.own_sigma).all()


@pytest.mark.thorough
@pytest.mark.parametrize("delay", [0.0, 0.004])
def test_the_smoothed_log_has_the_torques_of_its_positions(delay, truth):
    """Away from reversals, across which it is smooth, too: with wide masks, and without another filter."""
    log = simulate(scenario(timing=replace(load("ideal").timing, delay=delay))).alone()
    log = noisy(log, BITS16, 0.0)
    better = smoothed_log(identify(log, scara(), EXPLICIT, estimator=ML).fits[()])
    assert better.torque == log.torque
    chain = replace(idbench_chain(), prefilter=NoPrefilter(), mask=ReversalMask(width=0.03, taper=0.1))
    before, after = (identify(one, scara(), EXPLICIT, chain, WeightedLeastSquares()).X - truth for one in (log, better))
    assert np.exp(np.mean(np.log(np.abs(after) / np.abs(before)))) < 0.5
