"""Noise of torques and positions, propagated to rows and parameters: the corrected sigma."""

import gc
from dataclasses import replace

import numpy as np
import pytest
from builders import SOLVED, dense, noisy

from idbench.identify import (
    ESTIMATORS,
    MASKS,
    MODELS,
    OPERATORS,
    ButterworthPrefilter,
    Estimate,
    FirLowPass,
    MotionLog,
    NoPrefilter,
    Problem,
    TorqueChannel,
    WeightedLeastSquares,
    idbench_chain,
    identify,
    identify_each,
    paper_chain,
    scara,
)
from idbench.identify.estimators.log_rows import noise_covariance
from idbench.identify.noise.linearization import Linearization
from idbench.identify.noise.propagation import position_paths, torque_paths

CHANNELS = [TorqueChannel("instantaneous"), TorqueChannel("held", 0.003), TorqueChannel("averaged", -0.004)]
EVERY = {name: MODELS.create(name) for name in SOLVED}
DRAWS = 300

STAGES = [("fir", channel) for channel in CHANNELS] + [(name, CHANNELS[1]) for name in OPERATORS.builtin if name != "fir"]
"""Operators and torques follow each other: every one of both, not all pairs."""

WAYS = [(*stage, "explicit") for stage in STAGES] + [(*STAGES[1], model) for model in SOLVED if model != "explicit"]
"""So do models."""


def rows_of(log, model, chain):
    return Problem((log,), scara(), EVERY[model], chain).rows


FILTERED = replace(idbench_chain(), prefilter=ButterworthPrefilter(8.0), trim=2.0)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("chain", "channel", "model"),
    [
        *((replace(idbench_chain(), operator=OPERATORS.create(operator)), *way) for operator, *way in WAYS),
        pytest.param(FILTERED, CHANNELS[0], "explicit", id="prefilter"),  # a symmetric filter is its own adjoint within a log
    ],
)
def test_noise_of_the_torque_in_rows_out(chain, model, channel, log, rng):
    """Sums of rows that noise makes, noise by noise: Y is linear in tau, so its covariance is that of the linear map.

    Exact to what 400 draws leave, 3.5 % each, four of those; more for the power of an averaged torque, whose covariance of
    torque and velocity over a period is left out, and for the recursive operator, whose prefix of the log it remembers.
    """
    log = replace(log, torque=channel)
    plain, drawn = (rows_of(x, model, chain) for x in (log, noisy(log, 0, [0.3, 0.1], (400,), rng)))
    G = rng.standard_normal((len(plain.Y), 3))
    C = torque_paths(plain.maps[0]).covariance(np.array([0.3, 0.1]))
    made = (drawn.Y - plain.Y) @ G
    np.testing.assert_allclose(np.sqrt(np.diag(C.of_sums(G))), np.std(made, axis=0), rtol=0.15)
    variance = C.variance
    seen = plain.valid & (variance > 0.01 * variance.max())
    assert np.mean(np.var(drawn.Y - plain.Y, axis=0)[seen] / variance[seen]) == pytest.approx(1, abs=0.05)


@pytest.mark.thorough
@pytest.mark.parametrize(("operator", "channel", "model"), WAYS, ids=lambda way: getattr(way, "meaning", way))
def test_noise_of_the_positions_in_rows_out(operator, model, channel, log, truth, rng):
    """Noise of 1e-7 rad, small enough to be linear, put into the log: sums of the rows' errors, and each row's variance.

    The unmasked end of a move apart, where qdd jumps and the reversal's friction is none of the linear map's. To 400 draws,
    and to the product rule of differences that span six samples.
    """
    chain = replace(idbench_chain(), operator=OPERATORS.create(operator))
    level = np.array([1e-7, 3e-7])
    log = replace(log, torque=channel)
    plain, drawn = (rows_of(x, model, chain) for x in (log, noisy(log, level, 0, (400,), rng)))
    error = drawn.Y - drawn.W @ truth - (plain.Y - plain.W @ truth)
    G = rng.standard_normal((len(plain.Y), 3))
    C = position_paths(plain.maps[0], linear(plain, truth)).covariance(level)
    np.testing.assert_allclose(np.sqrt(np.diag(C.of_sums(G))), np.std(error @ G, axis=0), rtol=0.17)
    variance = C.variance
    seen = plain.valid & (variance > 0.01 * variance.max())
    assert np.median(np.var(error, axis=0)[seen] / variance[seen]) == pytest.approx(1, abs=0.2)


def linear(rows, truth):
    return Linearization(rows.maps[0].signals, scara(), truth)


def test_a_banded_covariance_is_that_of_its_sums(log, truth, rng):
    """Against the whole matrix, put together from the bands: sums of rows, variances, and sums of products."""
    plain = rows_of(log, "implicit", idbench_chain())
    of_torque, of_position = torque_paths(plain.maps[0]), position_paths(plain.maps[0], linear(plain, truth))
    C = of_torque.covariance(np.array([0.3, 0.1])) + of_position.covariance(np.full(2, 1e-4))
    lags, _, kinds = C.bands.shape[:3]
    whole = dense(C)
    G = rng.standard_normal((len(plain.Y), 3))
    np.testing.assert_allclose(C.of_sums(G), G.T @ whole @ G, rtol=1e-9)
    np.testing.assert_allclose(C.variance, np.diag(whole), rtol=1e-12)
    one = whole[::kinds, ::kinds]
    sums = [np.trace(one, offset=lag) for lag in range(lags)]
    np.testing.assert_allclose(C.bands[..., 0, 0].sum(axis=-1), sums, rtol=1e-9, atol=1e-12 * sums[0])
    seen = plain.valid.nonzero()[0]
    assert np.linalg.eigvalsh(whole[np.ix_(seen, seen)]).min() > 0


@pytest.mark.parametrize("bits", [12, 14, 16])
def test_the_noise_of_an_encoder_is_found(bits, log):
    """Counts of a moving joint are uniform within a step: step / sqrt(12). Those of a smooth slow motion repeat themselves, and
    so leave less in the rows, by up to a fifth at 16 bits, than white noise does."""
    step = 2 * np.pi / 2**bits
    counted = MotionLog(log.fs, np.round(log.q / step) * step, log.tau, log.torque)
    found = Problem((counted,), scara(), EVERY["explicit"], idbench_chain()).noise.position
    np.testing.assert_allclose(found, step / np.sqrt(12), rtol=0.2)


@pytest.mark.thorough
def test_torque_noise_is_found_beside_stronger_noise_of_the_positions(log):
    """Rows of up to 10 Hz, in which positions make most of the noise, not of what a motion tells: the rest of a difference of
    two large numbers would be anything. 60 draws; between half and twice, as rows of changing weight are taken for even ones.
    """
    sigma, chain = np.array([0.05, 0.0025]), replace(idbench_chain(), operator=FirLowPass(10.0, 10.0))
    problem = Problem((noisy(log, 2.8e-5, sigma, (60,), 3),), scara(), EVERY["explicit"], chain)
    rows, levels = problem.rows, problem.noise
    of_torque = torque_paths(rows.maps[0]).covariance(levels.torque).variance
    of_position = position_paths(rows.maps[0], problem.parts[0].linear).covariance(levels.position).variance
    assert (rows.by_kind(of_torque).sum(axis=-1) < rows.by_kind(of_position).sum(axis=-1)).all()
    assert (np.abs(np.log2(np.median(levels.torque, axis=0) / sigma)) < 1).all()


def test_a_log_without_noise_of_its_positions_has_none(log):
    """After six differences a motion is below a thousandth of a 16-bit encoder's noise."""
    found = Problem((log,), scara(), EVERY["explicit"], idbench_chain()).noise.position
    assert (found < 1e-3 * 2 * np.pi / 2**16 / np.sqrt(12)).all()


@pytest.mark.thorough
def test_encoder_noise_makes_no_more_of_sigma_than_it_should(log, truth):
    """16 bits, positions alone noisy: sigma is the scatter, to 80 draws. White rows would make it three times as large."""
    for name, found in identify_each(noisy(log, 2.77e-5, 0, (80,), 7), scara(), EVERY).items():
        z = (found.X - truth) / found.calibrated_sigma
        assert np.sqrt(np.mean(z**2)) == pytest.approx(1, abs=0.3), name


@pytest.mark.thorough
@pytest.mark.parametrize(("sigma", "share"), [((0.5, 0.005), 0.75), ((0.02, 0.3), 0.75)])
def test_the_power_models_weights_know_that_joints_differ(sigma, share, log):
    """Against weights that take the noises of all joints as equal, sqrt(|qd|^2 + 1.5^2): Fv1 scatters at most 3/4 of that."""
    draws = noisy(log, 0, sigma, (200,))
    found = identify(draws, scara(), EVERY["power"], estimator=WeightedLeastSquares())
    qd = idbench_chain().signals(log).state.qd
    rows = rows_of(log, "power", idbench_chain())
    k = np.rint(rows.time * log.fs).astype(int)
    weight = 1 / np.sqrt(np.sum(qd**2, axis=0)[k] + 1.5**2)
    other = np.linalg.lstsq(rows.W * weight[:, None], (found.rows.Y * weight).T, rcond=None)[0].T
    assert found.X[:, 1].std() < share * other[:, 1].std()


def test_weighting_does_not_undo_the_mask(log, rng):
    """Rows of modulating functions that the mask takes a part of stay as small as it makes them."""
    chain = replace(idbench_chain(), operator=OPERATORS.create("modulating"))
    found = identify(noisy(log, 0, (0.5, 0.025), (1,)), scara(), EVERY["explicit"], chain, WeightedLeastSquares())
    (weights,) = found.solution.weights(found.problem.parts)
    for kind in (0, 1):
        assert np.ptp(weights[..., found.rows.group == kind]) == 0


@pytest.mark.thorough
@pytest.mark.parametrize("mask", MASKS.builtin)
def test_the_level_of_each_joint_is_found(log, mask):
    """From 4600 samples differences show a level to 2 %, from some 280 rows residuals to 5 %; the less is 2 % low."""
    chain = replace(idbench_chain(), mask=MASKS.create(mask))
    levels = Problem((noisy(log, 0, (0.5, 0.025), (DRAWS,)),), scara(), EVERY["power"], chain).noise.torque
    np.testing.assert_allclose(np.sqrt(np.mean(levels**2, axis=0)), (0.5, 0.025), rtol=0.035)
    assert (levels.std(axis=0) / levels.mean(axis=0) < 0.06).all()


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("operator", "channel", "prefilter"),
    [*((*stage, NoPrefilter()) for stage in STAGES), ("fir", CHANNELS[-1], ButterworthPrefilter(4.0))],
    ids=lambda stage: stage if isinstance(stage, str) else getattr(stage, "meaning", "") or type(stage).__name__,
)
def test_what_comes_before_the_operator_is_not_counted_twice(log, operator, prefilter, channel):
    """Noise far above the misfit of a torque that is called what it is not: level and sigma are right behind every stage.

    To 4 %: rows whose weights change over what they look at are taken for such whose do not.
    """
    chain = replace(idbench_chain(), prefilter=prefilter, operator=OPERATORS.create(operator))
    draws, weighted = noisy(replace(log, torque=channel), 0, 300.0, (100,)), WeightedLeastSquares()
    found = identify(draws, scara(), EVERY["explicit"], chain, weighted)
    np.testing.assert_allclose(np.sqrt(np.mean(found.problem.noise.torque**2, axis=0)), 300.0, rtol=0.04)
    rms = np.sqrt(np.mean(found.calibrated_sigma**2, axis=0))
    np.testing.assert_allclose(rms, found.X.std(axis=0), rtol=0.28)  # four times what 100 draws leave


def test_two_logs_are_worth_two(log):
    """Of one fit: half the variance, where noise levels are the same."""
    one = noisy(log, 0, 0.1, (1,))
    single, double = (identify(x, scara(), EVERY["power"]) for x in (one, [one, one]))
    parts = double.solution.influence(double.problem.parts)  # of weights that the noise of both logs made
    np.testing.assert_array_equal(*parts)
    whole = noise_covariance(double.problem, parts)
    half = double.problem.parts[0].covariance.of_sums(parts[0])
    np.testing.assert_allclose(whole, 2 * half, rtol=1e-9)
    np.testing.assert_allclose(2 * double.calibrated_covariance, single.calibrated_covariance, rtol=0.1)


def test_without_an_influence_nothing_is_said(log):
    """But the estimator's own sigma is there to be shown."""
    estimate = Estimate.judge(Problem((log,), scara(), EVERY["explicit"], paper_chain()), np.ones(8))
    assert np.isnan(estimate.calibrated_sigma).all()
    np.testing.assert_array_equal(estimate.standard_errors, estimate.own_sigma)


@pytest.mark.parametrize("estimator", ["WLS", "GLS"])
def test_no_circle_of_references_outlives_an_identification(log, estimator):
    """Problems and their rows are large: what nobody holds any more is gone at once, not when the garbage is collected."""
    one = noisy(log, 0, (0.1, 0.005), (1,))
    gc.collect()
    gc.disable()
    try:
        identify_each(one, scara(), EVERY, estimator=ESTIMATORS.create(estimator))
        assert gc.collect() == 0
    finally:
        gc.enable()
