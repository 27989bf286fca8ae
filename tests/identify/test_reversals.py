"""Maximum likelihood through reversals, on logs of another simulator."""

from functools import cache

import exact_scara as exact
import numpy as np
import pytest
from scipy.linalg import lapack

from idbench.identify import (
    MODELS,
    MaximumLikelihood,
    MotionLog,
    NoiseLevels,
    Problem,
    TorqueChannel,
    cramer_rao,
    idbench_chain,
    scara,
)
from idbench.identify.estimators.likelihood.cells import Cells
from idbench.identify.estimators.likelihood.joint_fit import JointFit
from idbench.identify.estimators.likelihood.normal_equations import NormalEquations, torque_squares
from idbench.identify.noise.band_matrix import solve_lower

EXPLICIT, HELD, FS, RUNS = MODELS.create("explicit"), TorqueChannel("held"), 100.0, 16
MASKED, USED = MaximumLikelihood(), MaximumLikelihood(reversals=True)

LAWS = {
    "coulomb": {},
    "stribeck of 0.05 rad/s": {"law": exact.stribeck(0.05, 0.3)},
    "soft": {"law": exact.soft(0.02), "jumps": False},
    "static": {"static": 1.2},
}


@cache
def logged(motion, law, runs=RUNS):
    return exact.simulated(getattr(exact, motion)(runs), **LAWS[law])


def fitted(q, tau, bits, torque, estimator, delay=0.0):
    rng, sigma = np.random.default_rng(bits), 2 * np.pi / 2**bits / np.sqrt(12)
    noisy = MotionLog(FS, q + sigma * rng.standard_normal(q.shape), tau + torque * rng.standard_normal(tau.shape),
                      TorqueChannel("held", delay))  # fmt: skip
    return estimator.fit(Problem((noisy,), scara(), EXPLICIT, idbench_chain()), throw=False)


def typical(found, runs=slice(None)):
    return np.exp(np.mean(np.log(np.sqrt(np.mean((found.X[runs] / exact.X - 1) ** 2, axis=0)))))


def compared(*args):
    """Return typical errors with reversals used, and left out, of the runs in which neither fit is refused."""
    both = [fitted(*args[:4], estimator, *args[4:]) for estimator in (USED, MASKED)]
    runs = np.isfinite(both[0].X + both[1].X).all(axis=-1)
    assert np.count_nonzero(~runs) <= 1
    return [typical(one, runs) for one in both]


@pytest.mark.thorough
def test_slopes_of_the_cost_are_those_of_differences():
    """Of the parameters to 1e-5, of nodes beside reversals to what slopes at a cell's middle leave."""
    q, v, tau = logged("series", "coulomb", 1)
    log = MotionLog(FS, q[0, :400], tau[0, :400], HELD)
    z = np.stack([np.append(x[0, :400], x[0, 400:401], axis=0) for x in (q, v)], axis=1)
    fit = JointFit(
        (Cells.of(log),), scara(), exact.X, (z,), NoiseLevels(np.array([0.1, 0.1]), np.full(2, 1e-3)), near=np.ones(2)
    )
    noise = fit.noise(0)
    assert len(noise.turns.crossings) >= 3

    def cost(X, z):
        return NormalEquations.of(fit.logs[0], scara(), X, z, noise).cost

    found = NormalEquations.of(fit.logs[0], scara(), exact.X, z, noise)
    for k in range(8):
        step = 1e-4 * np.eye(8)[k]
        slope = (cost(exact.X + step, z) - cost(exact.X - step, z)) / 2e-4
        assert -2 * found.b_parameters[k, 0] == pytest.approx(slope, rel=1e-5, abs=1e-6)
    rng = np.random.default_rng(0)
    wild = z + 1e-4 * rng.standard_normal(z.shape)
    found = NormalEquations.of(fit.logs[0], scara(), exact.X, wild, noise)
    for one in noise.turns.crossings:
        for node in (one.cell, one.cell + 1):
            step = np.zeros_like(z)
            step[node, 1, one.joint] = 1e-7
            slope = (cost(exact.X, wild + step) - cost(exact.X, wild - step)) / 2e-7
            mine = -2 * found.b_nodes.reshape(*z.shape, -1)[node, 1, one.joint, 0]
            assert mine == pytest.approx(slope, rel=0.05), one


@pytest.mark.thorough
def test_the_true_motion_leaves_nothing_in_the_cells_of_reversals():
    """Torques of the cells in which friction jumps: to 1e-3 of the jump, 0.2 of which a sign at the middle would leave."""
    q, v, tau = logged("series", "coulomb", 1)
    z = np.stack([np.append(x[0], x[0, -1:], axis=0) for x in (q, v)], axis=1)
    log = MotionLog(FS, q[0], tau[0], HELD)
    fit = JointFit(
        (Cells.of(log),), scara(), exact.X, (z,), NoiseLevels(np.full(2, 1e-4), np.full(2, 1e-5)), near=np.full(2, 1e-4)
    )
    noise = fit.noise(0)
    assert len(noise.turns.crossings) >= 20
    squares = torque_squares(fit.logs[0], scara(), exact.X, z, noise)
    rms = 1e-4 * np.sqrt(squares[1] / noise.turns.near.sum(axis=1))
    assert (rms < 1e-3 * 2 * exact.COULOMB).all()


def test_bands_are_solved_as_lapack_does(rng):
    for size, width, right in ((5, 4, 3), (1001, 28, 7), (4097, 8, 12), (300, 80, 2)):
        band = np.concatenate([np.full((1, size), 3.0 * width), rng.standard_normal((width - 1, size))])
        L, bad = lapack.dpbtrf(band, lower=True)
        assert not bad
        b = rng.standard_normal((size, right))
        wanted, _ = lapack.dtbtrs(L, b, uplo="L")
        solve_lower(L, b)
        np.testing.assert_allclose(b, wanted, rtol=1e-9, atol=1e-12)


@pytest.mark.thorough
@pytest.mark.parametrize("bits", [16, 14, 12])
@pytest.mark.parametrize("motion", ["series", "moves"])
def test_errors_are_near_the_bound_that_knows_friction_through_reversals(motion, bits):
    """Typical errors of 16 logs, known to a fifth: at most 2.2 times the bound, and less than with reversals left out.

    The bound has torques that are off by 1e-4 and 1e-5 N m. Sigma holds.
    """
    q, v, tau = logged(motion, "coulomb")
    noise = NoiseLevels(np.array([1e-4, 1e-5]), np.full(2, 2 * np.pi / 2**bits / np.sqrt(12)))
    C = cramer_rao(scara(), exact.X, q, v, FS, noise, reversals=True)
    bound = np.exp(np.mean(np.log(np.sqrt(np.mean(np.diagonal(C, axis1=-2, axis2=-1), axis=0)) / exact.X)))
    used, masked = (fitted(q, tau, bits, 0.0, estimator) for estimator in (USED, MASKED))
    assert typical(used) < 2.2 * bound
    assert typical(used) < 0.8 * typical(masked)
    assert np.mean(np.abs(used.X - exact.X) < 2 * used.own_sigma) > 0.9


@pytest.mark.thorough
@pytest.mark.parametrize("motion", ["series", "moves"])
@pytest.mark.parametrize("law", ["stribeck of 0.05 rad/s", "soft", "static"])
def test_another_friction_near_rest_costs_next_to_nothing(law, motion):
    """At most a twentieth, and what two fits of 16 logs differ by, beside the fit that leaves reversals out."""
    q, _, tau = logged(motion, law)
    used, masked = compared(q, tau, 16, 0.0)
    assert used < 1.1 * masked


@pytest.mark.thorough
@pytest.mark.parametrize("motion", ["series", "moves"])
def test_backlash_and_a_wrong_delay_cost_next_to_nothing(motion):
    """Half a count that an encoder lags behind in either direction, of 16 bits; a delay off by 0.2 ms: a tenth at most."""
    q, v, tau = logged(motion, "coulomb")
    lagging = q - 0.25 * 2 * np.pi / 2**16 * np.sign(v)
    for positions, delay in ((lagging, 0.0), (q, 0.0002)):
        used, masked = compared(positions, tau, 16, 0.0, delay)
        assert used < 1.1 * masked


@pytest.mark.thorough
def test_where_torque_noise_rules_little_is_gained_and_nothing_lost():
    q, _, tau = logged("series", "coulomb")
    used, masked = (fitted(q, tau, 16, 0.01, estimator) for estimator in (USED, MASKED))
    assert typical(used) < 1.02 * typical(masked)
    assert np.sqrt(np.mean(((used.X - exact.X) / used.own_sigma) ** 2)) == pytest.approx(1.0, abs=0.25)


@pytest.mark.thorough
def test_a_fit_says_why_it_leaves_reversals_out():
    """Of friction that is soft below 0.05 rad/s; where it is as its law says, they are used, and nothing is said.

    Soft below 0.02 rad/s, half of the logs gain a tenth of sigma by them, rightly: errors are 14 % less.
    """
    for law, used in (({}, True), ({"law": exact.soft(0.05), "jumps": False}, False)):
        q, _, tau = exact.simulated(exact.moves(4), **law)
        for fit in fitted(q, tau, 16, 0.0, USED).fits.values():
            assert (fit.near is not None) == used
            assert (fit.left_out == "") == used
