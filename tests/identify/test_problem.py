"""What an estimator can ask of a problem: an estimator written against public names alone proves that it is enough."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
import scipy

from idbench.identify import (
    ESTIMATORS,
    MODELS,
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
from idbench.identify.rows import rows


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


def test_rows_of_another_log_have_the_measured_logs_weights(log):
    moved = MotionLog(log.fs, log.q[::-1], log.tau, log.torque)
    problem = Problem((log,), scara(), ExplicitModel(), idbench_chain())
    np.testing.assert_array_equal(problem.at(moved).valid, problem.rows.valid)
    own = Problem((moved,), scara(), ExplicitModel(), idbench_chain()).rows
    assert (problem.at(moved).W != own.W).any()
    with pytest.raises(LogError, match="one log for each"):
        problem.at([log, log])


def test_output_error_uses_the_log(rng):
    """A joint of 2 kg m^2 with viscous friction, driven by steps; positions noisy by 1e-4 rad."""
    tau = np.repeat(rng.uniform(-5, 5, 40), 25)[:, None]
    exact = MotionLog(100.0, np.zeros_like(tau), tau, TorqueChannel("held"))
    q = positions(exact, (2.0, 0.7))[:, None] + 1e-4 * rng.standard_normal(tau.shape)
    basis = Basis(1, (Armature(), ViscousFriction()))
    found = identify(MotionLog(100.0, q, tau, exact.torque), basis, ExplicitModel(), estimator=OutputError())
    np.testing.assert_allclose(found.X, [2.0, 0.7], rtol=1e-3)
    assert (np.abs(found.X - [2.0, 0.7]) < 5 * found.own_sigma).all()
    assert np.isnan(found.calibrated_sigma).all()
    np.testing.assert_array_equal(found.standard_errors, found.own_sigma)


def test_a_basis_may_be_exchanged_and_signals_stay(log):
    problem = Problem((log,), scara(), ExplicitModel(), idbench_chain())
    other = problem.with_basis(Basis(2, (ViscousFriction(), CoulombFriction())))
    assert other.names == ("Fv1", "Fv2", "Fs1", "Fs2")
    assert other.signals is problem.signals
    assert other.rows.W.shape[-1] == 4


def test_an_estimator_that_needs_rows_is_refused_a_log_too_long_for_them(log, monkeypatch):
    """It would have been handed triangular factors, and would have returned another X without a word."""
    monkeypatch.setattr(rows, "LONG", 1000)
    problem = Problem((log,), scara(), ExplicitModel(), idbench_chain())
    with pytest.raises(IdentificationError, match="IRLS needs rows, and the rows of 4600 samples"):
        estimate(problem, ESTIMATORS.create("IRLS"))
    assert np.isfinite(estimate(problem, WeightedLeastSquares()).calibrated_sigma).all()


def test_rows_of_power_stand_below_those_of_the_explicit_model(log):
    """At every instant the n torques of the one, then the power of the other."""
    problem = Problem((log,), scara(), ExplicitModel(), idbench_chain())
    explicit, power, both = (problem.with_model(MODELS.create(name)).rows for name in ("explicit", "power", "explicit+power"))
    assert both.kinds == 3
    for name in ("Y", "W"):
        own = getattr(both, name).reshape(-1, 3, *getattr(both, name).shape[1:])
        np.testing.assert_allclose(own[:, :2].reshape(getattr(explicit, name).shape), getattr(explicit, name))
        np.testing.assert_allclose(own[:, 2], getattr(power, name))
    found = estimate(problem.with_model(MODELS.create("explicit+power")), WeightedLeastSquares())
    alone = estimate(problem, WeightedLeastSquares())
    off = (found.X - alone.X) / alone.standard_errors
    assert np.abs(off).max() < 1  # rows of the same noise
    share = found.standard_errors / alone.standard_errors
    assert (share > 0.5).all()
    assert (share < 1.3).all()  # friction is squared in the row of power alone
