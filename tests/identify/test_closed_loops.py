"""What the whole bench is for: parameters out of closed loops with encoders and drives, and out of another simulator's logs."""

from dataclasses import replace

import numpy as np
import pytest
from builders import SOLVED
from scipy.integrate import solve_ivp

from idbench.identify import (
    MODELS,
    OPERATORS,
    AsLogged,
    MotionLog,
    TorqueChannel,
    WeightedLeastSquares,
    idbench_chain,
    identify,
    identify_each,
    scara,
)
from idbench.sim.drives import AveragedDrive, SwitchedDrive
from idbench.sim.encoders import IncrementalEncoder
from idbench.sim.engine.simulation import simulate
from idbench.sim.scenario.measurement import TorqueMeasurement
from idbench.sim.scenario.scenario import Timing
from idbench.sim.scenario.scenario_file import load
from idbench.sim.trajectories import RandomMoves

FORMS = {name: MODELS.create(name) for name in ("explicit", "implicit", "power")}


def errors(log, truth, **options):
    return {k: e.relative_error_percent(truth) for k, e in identify_each(log, scara(), FORMS, **options).items()}


AVERAGED = replace(load("ideal"), drive=AveragedDrive())
OFFSETS = np.random.default_rng(1).random(5)
"""Encoders mounted at five angles: five realizations of quantization on the motion that ships."""


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("parts", "dynamic", "power"),
    [
        *(({"encoder": IncrementalEncoder(lines=2**14, offset=x)}, 1.0, 2.0) for x in OFFSETS),
        *(({"encoder": IncrementalEncoder(lines=2**18), "trajectory": RandomMoves(seed=k)}, 0.5, 0.5) for k in range(5)),
    ],
)
def test_the_encoder_is_all_that_an_averaged_drive_leaves(parts, dynamic, power, truth):
    """Worst of eight parameters [%]: of 16 bits, and of 20 on motions that nothing was chosen by."""
    for form, error in errors(simulate(replace(AVERAGED, **parts)).alone(), truth).items():
        assert error.max() < (power if form == "power" else dynamic), form


@pytest.fixture(scope="module", params=[0.0, 0.003, 0.0052, 0.007, 0.010, 0.013], ids=lambda delay: f"late by {delay}")
def held(request):
    """A log of held torques with a computing delay, and an exact encoder."""
    return simulate(replace(load("ideal"), timing=Timing(delay=request.param))).alone()


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("model", "operator"), [*((model, "fir") for model in SOLVED), ("power", "windows"), ("power", "modulating")]
)
def test_a_held_torque_that_says_so_is_identified(model, operator, held, truth):
    """The remaining error is RK4 at 1 ms and MuJoCo's soft friction near standstill."""
    chain = replace(idbench_chain(), operator=OPERATORS.create(operator))
    assert identify(held, scara(), MODELS.create(model), chain).relative_error_percent(truth).max() < 0.1


@pytest.mark.thorough
def test_unaligned_it_shows_the_negative_friction_of_the_papers_table_2(held, truth):
    models, chain = {name: MODELS.create(name) for name in SOLVED}, replace(idbench_chain(), alignment=AsLogged())
    found = identify_each(held, scara(), models, chain)
    for estimate in found.values():
        assert estimate.X[1] < 0  # Fv1
        assert estimate.X[2] > truth[2]  # Fs1
    np.testing.assert_allclose(found["explicit"].X, found["implicit"].X, rtol=1e-2)


@pytest.mark.thorough
def test_a_chopper_gives_the_parameters_of_its_average(robot):
    """Within one sigma of either, over the parameters in the mean: two estimates of independent noise lie 1.1 sigma apart.

    On three motions, simulated together. By weighted least squares: sigma of the generalized ones, a fifth of it, shows the
    chopper's ripple.
    """
    scenario = replace(load("ideal"), encoder=IncrementalEncoder(lines=2**14))
    moves = [RandomMoves(seed=seed, moves=8, durations=(1.32, 1.32), rest=1.4).sample(robot, 100.0) for seed in range(3)]
    forms = {name: FORMS[name] for name in ("explicit", "power")}
    averaged, switched = (
        identify_each(
            simulate(replace(scenario, drive=drive), range(3), motions=moves).log,
            scara(),
            forms,
            estimator=WeightedLeastSquares(),
        )
        for drive in (AveragedDrive(), SwitchedDrive())
    )
    for form in forms:
        a, s = averaged[form], switched[form]
        assert (np.mean(np.abs(a.X - s.X) / (a.own_sigma + s.own_sigma), axis=-1) < 1).all()


def foreign(fs=100.0, bits=18, noise=(0.0, 0.0), seed=0):
    """A log of another arm by other software: its own equations, its own Runge-Kutta with error control, its own PD loop."""
    X = np.array([2.9, 0.31, 0.9, 0.08, 0.16, 0.02, 0.06, 0.22])
    rng = np.random.default_rng(seed)
    reference = load("brisk").trajectory.points.sample(fs)

    def rate(t, x, u):
        q2, v1, v2 = x[1], x[2], x[3]
        k, s = X[4] * np.cos(q2) - X[5] * np.sin(q2), -X[4] * np.sin(q2) - X[5] * np.cos(q2)
        M = np.array([[X[0] + X[3] + 2 * k, X[3] + k], [X[3] + k, X[3]]])
        friction = np.array([X[1] * v1 + X[2] * np.tanh(v1 / 1e-4), X[6] * v2 + X[7] * np.tanh(v2 / 1e-4)])
        coriolis = np.array([s * v2 * (2 * v1 + v2), -s * v1**2])
        return [v1, v2, *np.linalg.solve(M, u - friction - coriolis)]

    M0, x, count = np.array([3.4, 0.08]), np.array([*reference.q[0], 0.0, 0.0]), 2 * np.pi / 2**bits
    q, u = np.empty((2, *reference.q.shape))
    before = reference.q[0]
    for k in range(len(q)):
        q[k] = np.rint(x[:2] / count) * count
        error = reference.q[k] - q[k]
        rising = reference.qd[k] - (q[k] - before) * fs
        before = q[k]
        u[k] = M0 * (reference.qdd[k] + 200 * error + 28 * rising)
        x = solve_ivp(rate, (0, 1 / fs), x, args=(u[k],), method="LSODA", rtol=1e-8, atol=1e-10).y[:, -1]
    return MotionLog(fs, q, u + rng.normal(size=u.shape) * noise, TorqueChannel("held")), X


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("bits", "noise", "dynamic", "power"), [(18, (0.0, 0.0), 0.5, 0.5), (16, (0.05, 0.0025), 1, 3)], ids=["exact", "noisy"]
)
def test_a_foreign_log_is_identified(bits, noise, dynamic, power):
    log, X = foreign(bits=bits, noise=noise)
    for form, error in errors(log, X).items():
        assert error.max() < (power if form == "power" else dynamic), form


@pytest.mark.thorough
def test_such_noise_on_the_papers_own_robot_stays_within_three_sigma(truth):
    """Errors of eight parameters in five draws lie below 3 sigma, but for one in forty."""
    noisy = replace(load("ideal"), torque=TorqueMeasurement(noise=(0.05, 0.0025)), encoder=IncrementalEncoder(lines=2**14))
    run = simulate(noisy, range(5))
    for form, estimate in identify_each(run.log, scara(), FORMS).items():
        assert (np.abs(estimate.X - truth) < 3 * estimate.own_sigma).mean() > 0.97, form
