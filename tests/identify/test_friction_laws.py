"""Laws of friction with shapes, loads and conditions, on torques that are made of closed forms."""

from dataclasses import replace

import exact_scara
import numpy as np
import pytest

from idbench.identify import (
    BLOCKS,
    ESTIMATORS,
    ExplicitModel,
    LogError,
    MotionLog,
    NoMask,
    OfJoints,
    PowerModel,
    Problem,
    TorqueChannel,
    idbench_chain,
    identify,
    scara,
)
from idbench.identify.basis import LoadFriction, StribeckFriction
from idbench.identify.estimators.settle import settled
from idbench.identify.judge.friction_choice import choose_friction, falls
from idbench.identify.signals.signals import State

X = np.array([3.5, 0.5, 0.5, 0.06, 0.12, 0.005, 0.1, 0.2])
"""Parameters of the SCARA."""

FS, T = 200.0, 30.0


def motion(seed=0, fs=FS, duration=T):
    """Return q, qd, qdd of slow and fast sines, exactly, shape (joint, time), and the instants."""
    t, rng = np.arange(0, duration, 1 / fs), np.random.default_rng(seed)
    w = 2 * np.pi * np.array([0.05, 0.11, 0.23, 0.4])[:, None] * rng.uniform(0.8, 1.2, (2, 4, 1))
    a, phase = rng.uniform(0.5, 1.0, (2, 4, 1)) * np.array([1.5, 0.6, 0.3, 0.15])[:, None], rng.uniform(0, 6, (2, 4, 1))
    turned = w * t + phase
    return tuple(np.sum(x, axis=1) for x in (a * np.sin(turned), a * w * np.cos(turned), -a * w**2 * np.sin(turned))), t


def rigid(q, qd, qdd):
    """Return the torques of the SCARA, shape (joint, time)."""
    return exact_scara.torque(X, q.T, qd.T, qdd.T).T


def made(law, noise=0.0, seed=0, **conditions):
    """Return a log of the SCARA whose friction has a law beside Fs and Fv: law(q, qd, load)."""
    (q, qd, qdd), _ = motion(seed)
    tau = rigid(q, qd, qdd)
    load = tau - X[[1, 6]][:, None] * qd - X[[2, 7]][:, None] * np.sign(qd)
    tau = tau + law(q, qd, load) + noise * np.random.default_rng([seed, 1]).standard_normal(q.shape)
    return MotionLog(FS, q.T, tau.T, TorqueChannel("instantaneous"), conditions)


def no_law(q, qd, load):
    return 0 * q


def problem_of(law, noise=0.02, seed=0, basis=None):
    return Problem((made(law, noise, seed),), basis or scara(), ExplicitModel(), idbench_chain())


def stribeck_law(q, qd, load):
    del q, load
    return np.array([[0.3], [0.15]]) * np.exp(-((qd / np.array([[0.3], [0.25]])) ** 2)) * np.sign(qd)


SHAPED = {
    "stribeck": (stribeck_law, {"Fst1": 0.3, "Fst2": 0.15, "vs1": 0.3, "vs2": 0.25}),
    "stribeck-free": (
        lambda q, qd, load: 0.3 * np.exp(-np.abs(qd) / 0.4) * np.sign(qd),
        {"Fst1": 0.3, "vs2": 0.4, "ds1": 1.0, "ds2": 1.0},
    ),
    "arctan": (lambda q, qd, load: 0.6 * np.arctan(qd / 0.3) / np.pi * 2, {"Fat1": 0.6, "Fat2": 0.6, "vat1": 0.3, "vat2": 0.3}),
    "load": (lambda q, qd, load: 0.08 * np.abs(load) * np.sign(qd), {"Fl1": 0.08, "Fl2": 0.08}),
    "asymmetric-viscous": (lambda q, qd, load: 0.04 * np.abs(qd), {"Fva1": 0.04, "Fva2": 0.04}),
    "offset": (lambda q, qd, load: 0.04 * np.ones_like(qd), {"off1": 0.04}),
    "cogging": (lambda q, qd, load: 0.1 * np.sin(12 * q) - 0.05 * np.cos(12 * q), {"C12s1": 0.1, "C12c2": -0.05}),
}


IN_PLACE = {
    "tanh": ("Fs", lambda q, qd, load: 0.6 * np.tanh(qd / 0.3) - X[[2, 7]][:, None] * np.sign(qd), {"Ft1": 0.6, "vt2": 0.3}),
    "power": ("Fv", lambda q, qd, load: 0.6 * np.abs(qd) ** 0.6 * np.sign(qd) - X[[1, 6]][:, None] * qd, {"Fp2": 0.6}),
}
"""Laws in the place of another."""


@pytest.mark.parametrize(
    ("name", "basis", "law", "truth"),
    [
        *((name, scara(), *shaped) for name, shaped in SHAPED.items()),
        *((name, scara().without(f"{idle}1", f"{idle}2"), *shaped) for name, (idle, *shaped) in IN_PLACE.items()),
        (StribeckFriction(vs=np.array([[0.3], [0.25]])), scara(), stribeck_law, {"Fst1": 0.3, "Fst2": 0.15}),
    ],
    ids=[*SHAPED, *IN_PLACE, "shapes known"],
)
def test_a_law_is_recovered(name, basis, law, truth):
    """To 2 %: the remaining error is the smoothing of the kinks at reversals."""
    block = BLOCKS.create(name) if isinstance(name, str) else name
    assert estimates(made(law), basis + block, truth) == pytest.approx(truth, rel=0.02)


def estimates(log, basis, names):
    found = identify(log, basis, ExplicitModel(), estimator=ESTIMATORS.create("WLS"))
    return {name: x for name, x in zip(found.names, found.X, strict=True) if name in names}


def test_the_column_of_a_shape_is_its_slope():
    (q, qd, _), _ = motion()
    law = replace(BLOCKS.create("stribeck"), size=np.array([0.7, -0.2]), values={"vs": np.array([0.2, 0.4])})
    v, vs, size = qd, np.array([[0.2], [0.4]]), np.array([[0.7], [-0.2]])
    slope = size * 2 * v**2 / vs**3 * np.exp(-((v / vs) ** 2)) * np.sign(v)
    np.testing.assert_allclose(law.torques(State(q, qd, np.zeros_like))["vs"], slope, atol=1e-7)
    assert {p.name: x for p, x in law.operating_point(2).items()} == {"vs1": 0.2, "vs2": 0.4}


@pytest.mark.thorough
def test_sigma_of_nonlinear_parameters_is_calibrated():
    """40 runs of white noise in one batch: two sigma hold 95 %, between 90 and 99 % of 480 correlated cases."""
    exact, rng = made(stribeck_law).part(0, 5000), np.random.default_rng(5)
    q, many = exact.q, exact.tau + 0.02 * rng.standard_normal((40, *exact.tau.shape))
    log = MotionLog(FS, np.broadcast_to(q, many.shape), many, TorqueChannel("instantaneous"))
    found = identify(log, scara() + BLOCKS.create("stribeck"), ExplicitModel(), estimator=ESTIMATORS.create("WLS"))
    true = np.array([*X, 0.3, 0.3, 0.15, 0.25])
    assert found.names[-4:] == ("Fst1", "vs1", "Fst2", "vs2")
    z = (found.X - np.median(found.X, axis=0)) / found.standard_errors
    assert 0.90 < np.mean(np.abs(z) < 2) < 0.99
    assert np.abs(np.median(found.X, axis=0) - true).max() < 0.02


def test_a_shape_has_one_minimum_out_of_several():
    """From a bad beginning, where a broad law with the other sign explains almost as much, it is left again."""
    law = BLOCKS.create("stribeck")
    wrong = replace(law, size=np.array([-0.5, -0.5]), values={"vs": np.array([1.0, 1.0])})
    found = settled(problem_of(stribeck_law, 0.002, basis=scara() + wrong))
    assert found.basis.operating_point[found.basis.names.index("vs1")] == pytest.approx(0.3, rel=0.05)


def test_laws_of_single_joints():
    basis = scara() + OfJoints(BLOCKS.create("stribeck"), (1,)) + OfJoints(BLOCKS.create("load"), (0,))
    assert [p.name for p in basis.parameters][-3:] == ["Fst2", "vs2", "Fl1"]
    found = identify(made(stribeck_law), basis, PowerModel())
    assert found.names == basis.names


def test_a_parameter_that_is_held_counts_as_known():
    """What is held at its true value leaves the estimates of the others as they are without noise."""
    log = made(no_law)
    for model in (ExplicitModel(), PowerModel()):
        whole = identify(log, scara(), model, estimator=ESTIMATORS.create("WLS"))
        held = identify(log, scara().holding(ZZR1=3.5, Fs2=0.2), model, estimator=ESTIMATORS.create("WLS"))
        rest = [i for i, name in enumerate(whole.names) if name in held.names]
        np.testing.assert_allclose(held.X, whole.X[rest], rtol=2e-3)
        np.testing.assert_allclose(held.residual_rms, whole.residual_rms, atol=2e-4)


def test_temperature_is_a_column_of_the_log():
    _, t = motion()
    above = 20 * (1 - np.exp(-t / 10))
    log = made(lambda q, qd, load: -0.01 * above * qd, temperature=np.tile(25 + above[:, None], 2))
    values = estimates(log, scara() + BLOCKS.create("temperature"), ("FvT1", "FsT2"))
    assert values["FvT1"] == pytest.approx(-0.01, rel=0.02)
    assert values["FsT2"] == pytest.approx(0, abs=1e-3)
    with pytest.raises(LogError, match="does not say the temperature that a law needs"):
        identify(made(stribeck_law), scara() + BLOCKS.create("temperature"), ExplicitModel())


def test_parts_and_runs_keep_their_conditions():
    log = made(stribeck_law, temperature=np.arange(FS * T)[:, None] * np.ones(2))
    assert log.part(10, 20).conditions["temperature"][0, 0] == 10
    with pytest.raises(LogError, match="temperature has shape"):
        replace(log, conditions={"temperature": np.ones((7, 2))})
    with pytest.raises(LogError, match="temperature is nan"):
        replace(log, conditions={"temperature": np.full((1, 1), np.nan)})


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("name", "law"),
    [("stribeck", stribeck_law), ("load", SHAPED["load"][0]), ("offset", SHAPED["offset"][0]), ("", no_law)],
)
def test_the_law_of_a_robot_is_chosen(name, law):
    candidates = {each: BLOCKS.create(each) for each in ("offset", "asymmetric-viscous", "load", "stribeck", "arctan")}
    for seed in range(2):
        found = choose_friction(problem_of(law, seed=seed), candidates)
        assert found.laws == ((name,) if name else (),) * 2, [s for s in found.scores if s.taken]


def test_the_load_is_all_torque_but_friction():
    (q, qd, qdd), _ = motion()
    law = LoadFriction().adapted(scara(), X)
    load = law.load(State(q, qd, lambda _: qdd))
    np.testing.assert_allclose(load, rigid(q, qd, qdd) - X[[1, 6]][:, None] * qd - X[[2, 7]][:, None] * np.sign(qd), atol=1e-12)


@pytest.mark.thorough
@pytest.mark.parametrize("smooth", [True, False])
def test_friction_without_a_jump_takes_the_place_of_coulomb(smooth):
    """Where no mask takes the instants at rest, in which alone the two differ."""
    law = (lambda q, qd, load: X[[2, 7]][:, None] * (np.tanh(qd / 0.05) - np.sign(qd))) if smooth else no_law
    problem = replace(problem_of(law), chain=replace(idbench_chain(), mask=NoMask()))
    found = choose_friction(problem, {each: BLOCKS.create(each) for each in ("offset", "stribeck", "tanh")})
    assert found.laws == (("tanh",),) * 2 if smooth else ((), ())
    assert found.idle == (("Fs",),) * 2 if smooth else ((), ())


def test_a_law_whose_shape_the_motion_leaves_open_is_not_chosen():
    """Arctan of a velocity above those of the log, about whose size nothing is known: it stands in for viscous friction."""
    problem = problem_of(lambda q, qd, load: -0.02 * qd**3)
    assert choose_friction(problem, {"arctan": BLOCKS.create("arctan")}).laws == ((), ())


def test_friction_that_falls_beyond_the_speeds_of_the_log_is_seen():
    """Viscous friction of 0.1, and of -0.7, beyond that of the robot."""
    rising, falling = (problem_of(lambda q, qd, load, a=a: a * qd) for a in (0.1, -0.7))
    assert [falls(rising, j) for j in (0, 1)] == [False, False]
    assert [falls(falling, j) for j in (0, 1)] == [True, True]


def test_a_law_that_makes_friction_fall_beyond_the_log_is_not_chosen():
    """Viscous friction that fades as |qd| grows: arctan about 1 rad/s and a negative Fv explain it."""
    problem = problem_of(lambda q, qd, load: 2 * np.arctan(qd / 1.0) - 1.2 * qd)
    candidates = {"arctan": BLOCKS.create("arctan")}
    plain = settled(problem.with_basis(scara() + candidates["arctan"]))
    assert all(falls(plain, j) for j in (0, 1))
    assert choose_friction(problem, candidates).laws == ((), ())
