"""What an estimator can ask of a problem: three estimators, written against public names alone, prove that it is enough."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest
import scipy

from identify import (
    AbstractEstimator,
    Armature,
    Basis,
    CoulombFriction,
    Estimate,
    ExplicitModel,
    IdentificationError,
    LogError,
    MotionLog,
    Problem,
    TorqueChannel,
    ViscousFriction,
    WeightedLeastSquares,
    estimate,
    idbench_chain,
    identify,
    scara,
)
from identify.rows import long_logs


@dataclass(frozen=True)
class Irls(AbstractEstimator):
    """Iteratively reweighted least squares with Huber's weights: it needs rows."""

    def solve(self, problem):
        W, Y = problem.rows.W, problem.rows.Y
        weight = np.ones_like(Y)
        for _ in range(30):
            WX = (W * weight[:, None]).T
            X = np.linalg.solve(WX @ W, WX @ Y)
            rho = Y - W @ X
            scale = np.take([1.4826 * np.median(np.abs(rho[problem.rows.group == k])) for k in (0, 1)], problem.rows.group)
            weight = np.minimum(1.0, 1.345 * scale / np.maximum(np.abs(rho), 1e-300)) / scale**2
        return Estimate.judge(problem, X, influence=(np.linalg.inv(WX @ W) @ WX).T)


@dataclass(frozen=True)
class InstrumentalVariables(AbstractEstimator):
    """X = (Z' W)^-1 Z' Y with Z the rows of a simulated log: it needs that log."""

    needs: ClassVar = frozenset({"rows", "simulate"})

    def solve(self, problem):
        W, Y = problem.rows.W, problem.rows.Y
        Z = problem.at(problem.simulate(None)).W
        G = np.linalg.solve(Z.T @ W, Z.T).T
        return Estimate.judge(problem, G.T @ Y, influence=G)


@dataclass(frozen=True)
class OutputError(AbstractEstimator):
    """Positions of one joint without gravity or load, simulated from its torques: it needs the log, and no rows."""

    needs: ClassVar = frozenset({"logs"})

    def solve(self, problem):
        (log,) = problem.logs
        found = scipy.optimize.least_squares(lambda X: positions(log, X) - log.q[:, 0], [1.0, 1.0], x_scale=[1.0, 1.0])
        covariance = np.linalg.inv(found.jac.T @ found.jac) * np.mean(found.fun**2)
        return Estimate.judge(problem, found.x, covariance)


def positions(log, X):
    """Return q of J qdd + Fv qd = tau, tau held, from rest at 0."""
    rate, h = X[1] / X[0], 1 / log.fs
    kept, lost = np.exp(-rate * h), -np.expm1(-rate * h) / rate
    gained, moved = lost / X[0], (h - lost) / rate / X[0]
    qd = scipy.signal.lfilter([0.0, gained], [1.0, -kept], log.tau[:, 0])
    steps = lost * qd + moved * log.tau[:, 0]
    return np.concatenate([[0.0], np.cumsum(steps)[:-1]])


@pytest.fixture
def wild(log, rng):
    """Torques of which one sample in fifty is off by up to 50 N m."""
    noise = [0.05, 0.005] * rng.standard_normal(log.tau.shape)
    spikes = (rng.random(log.tau.shape) < 0.02) * rng.uniform(-50, 50, log.tau.shape) * [1.0, 0.1]
    return MotionLog(log.fs, log.q, log.tau + noise, log.torque), MotionLog(log.fs, log.q, log.tau + noise + spikes, log.torque)


def test_irls_is_robust_where_weighted_least_squares_is_not(wild, truth):
    chain = replace(idbench_chain(), operator=replace(idbench_chain().operator, cutoff=20.0))

    def error(estimator):
        return np.sqrt(np.mean(((identify(wild[1], scara(), ExplicitModel(), chain, estimator).X - truth) / truth) ** 2))

    assert error(Irls()) < 0.5 * error(WeightedLeastSquares())


def test_irls_has_an_honest_sigma(wild):
    """On torques without wild samples it is that of weighted least squares, but for the 5 % that Huber's weights cost."""
    clean, _ = wild
    mine, other = (identify(clean, scara(), ExplicitModel(), estimator=e) for e in (Irls(), WeightedLeastSquares()))
    assert np.isfinite(mine.corrected_sigma).all()
    np.testing.assert_allclose(mine.best_sigma, other.best_sigma, rtol=0.3)


def test_instrumental_variables_take_the_noise_out_of_W(log, truth, rng):
    """10-bit counts behind a filter of 20 Hz: least squares loses inertia to the noise of its accelerations, IV does not."""
    step = 2 * np.pi / 2**10
    coarse = MotionLog(log.fs, log.q + step / np.sqrt(12) * rng.standard_normal(log.q.shape), log.tau, log.torque)
    chain = replace(idbench_chain(), operator=replace(idbench_chain().operator, cutoff=20.0))
    biased = identify(coarse, scara(), ExplicitModel(), chain)
    found = identify(coarse, scara(), ExplicitModel(), chain, InstrumentalVariables(), simulate=lambda X: log)
    assert abs(biased.X[0] / truth[0] - 1) > 5 * abs(found.X[0] / truth[0] - 1)
    assert np.isfinite(found.corrected_sigma).all()


def test_rows_of_another_log_have_the_measured_logs_weights(log):
    moved = MotionLog(log.fs, log.q[::-1], log.tau, log.torque)
    problem = Problem((log,), scara(), ExplicitModel(), idbench_chain())
    np.testing.assert_array_equal(problem.at(moved).valid, problem.rows.valid)
    own = Problem((moved,), scara(), ExplicitModel(), idbench_chain()).rows
    np.testing.assert_array_equal(problem.at(moved, "own").W, own.W)
    assert (problem.at(moved).W != own.W).any()
    with pytest.raises(LogError, match="one log for each"):
        problem.at([log, log])
    with pytest.raises(IdentificationError, match="weights = 'none' is none of"):
        problem.at(log, "none")


def test_output_error_uses_the_log(rng):
    """A joint of 2 kg m^2 with viscous friction, driven by steps; positions noisy by 1e-4 rad."""
    tau = np.repeat(rng.uniform(-5, 5, 40), 25)[:, None]
    exact = MotionLog(100.0, np.zeros_like(tau), tau, TorqueChannel("held"))
    q = positions(exact, (2.0, 0.7))[:, None] + 1e-4 * rng.standard_normal(tau.shape)
    basis = Basis(1, (Armature(), ViscousFriction()))
    found = identify(MotionLog(100.0, q, tau, exact.torque), basis, ExplicitModel(), estimator=OutputError())
    np.testing.assert_allclose(found.X, [2.0, 0.7], rtol=1e-3)
    assert (np.abs(found.X - [2.0, 0.7]) < 5 * found.sigma).all()
    assert np.isnan(found.corrected_sigma).all()
    np.testing.assert_array_equal(found.best_sigma, found.sigma)


def test_a_basis_may_be_exchanged_and_signals_stay(log):
    problem = Problem((log,), scara(), ExplicitModel(), idbench_chain())
    other = problem.with_basis(Basis(2, (ViscousFriction(), CoulombFriction())))
    assert other.names == ("Fv1", "Fv2", "Fs1", "Fs2")
    assert other.signals is problem.signals
    assert other.rows.W.shape[-1] == 4


def test_an_estimator_that_needs_rows_is_refused_a_log_too_long_for_them(log, monkeypatch):
    """It would have been handed triangular factors, and would have returned another X without a word."""
    monkeypatch.setattr(long_logs, "LONG", 1000)
    problem = Problem((log,), scara(), ExplicitModel(), idbench_chain())
    with pytest.raises(IdentificationError, match="Irls needs rows, and the rows of 4600 samples of 2 joints are too many"):
        estimate(problem, Irls())
    assert np.isfinite(estimate(problem, WeightedLeastSquares()).corrected_sigma).all()


def test_an_estimator_that_needs_a_simulator_is_refused_without_one(log):
    with pytest.raises(IdentificationError, match="InstrumentalVariables needs a way to simulate the robot"):
        identify(log, scara(), ExplicitModel(), estimator=InstrumentalVariables())


def test_without_a_log_there_is_no_problem():
    with pytest.raises(LogError, match="no log to identify"):
        Problem((), scara(), ExplicitModel(), idbench_chain())
