"""Physically consistent parameters that agree with the estimate and are otherwise those given."""

import numpy as np
import pytest
import scipy
from builders import arm

from idbench.identify import IdentificationError, consistent_parameters
from idbench.identify.data.kinematics import INERTIAL
from idbench.identify.parameters.bodies import inertial, pseudo_inertia
from idbench.sim.robot.rewrite import rewritten


@pytest.fixture(scope="module", params=["scara", "puma560", "panda"])
def robot(request):
    return arm(request.param)


@pytest.fixture
def scara():
    return arm("scara")


def places(grouping, j):
    """Return where the ten parameters of link j, from 0, stand."""
    return [grouping.standard.names.index(f"{x}{j + 1}") for x in INERTIAL]


def links(grouping, values):
    for j in range(grouping.standard.n):
        yield pseudo_inertia(values[places(grouping, j)])


def test_a_pseudo_inertia_holds_the_second_moments_of_the_mass(rng):
    points, masses = rng.normal(size=(20, 3)), rng.uniform(0.1, 1, 20)
    homogeneous = np.column_stack([points, np.ones(20)])
    inertia = sum(m * (x @ x * np.eye(3) - np.outer(x, x)) for m, x in zip(masses, points, strict=True))
    values = *inertia[np.triu_indices(3)], *(masses @ points), masses.sum()
    np.testing.assert_allclose(pseudo_inertia(values), (homogeneous.T * masses) @ homogeneous, atol=1e-12)


def test_the_truth_comes_back_from_an_estimate_without_error(robot):
    _, _, grouping, X = robot
    found = consistent_parameters(grouping, grouping.base(X), 1e-6 * np.eye(len(grouping.names)), X)
    assert found.agrees
    np.testing.assert_allclose(found.standard, X, atol=1e-5 * np.abs(X).max())


def test_another_given_model_changes_what_no_motion_shows_and_nothing_else(robot, rng):
    _, _, grouping, X = robot
    base = grouping.base(X)
    sigma = 1e-3 * np.maximum(np.abs(base), 0.01)
    other = X.copy()
    for j in range(grouping.standard.n):
        other[places(grouping, j)] *= rng.uniform(0.8, 1.25)
    found = consistent_parameters(grouping, base, np.diag(sigma**2), other)
    assert found.agrees
    assert np.abs(found.departure).max() < 0.1  # of a sigma
    assert min(np.linalg.eigvalsh(S)[0] for S in links(grouping, found.standard)) > 0
    assert np.abs(found.standard - X).max() > 1e-3  # the given model's where nothing else is known


def test_impossible_estimates_get_the_nearest_possible_bodies_and_are_told(robot):
    """Fs1 below zero by ten sigma: the nearest x of (x + 10)^2 / 2 - ln x, in sigma, is at x (x + 10) = 1."""
    _, _, grouping, X = robot
    base = grouping.base(X)
    sigma = np.full(len(base), 1e-3)
    i = grouping.names.index("Fs1")
    base[i] = -0.01
    found = consistent_parameters(grouping, base, np.diag(sigma**2), X)
    assert found.distance == pytest.approx(5 + np.sqrt(26), rel=1e-3)
    assert found.base[i] == pytest.approx(1e-3 * (np.sqrt(26) - 5), rel=1e-2)
    assert not found.agrees  # 10^2 is beyond 0.999 of chi^2, also with the 44 degrees of freedom of the Panda's bodies
    others = np.array([name not in ("Fs1",) for name in grouping.names])
    np.testing.assert_allclose(found.departure[others], 0, atol=0.05)


@pytest.mark.parametrize("mass", [1e-3, 1e-6, 1e-9, 1e-12])
def test_a_last_body_of_next_to_nothing_does_not_keep_the_estimate_away(robot, mass):
    """The file has a dot where the tool is; friction, which no body is coupled to, does not move at all, though correlated."""
    _, _, grouping, X = robot
    rng, base, given = np.random.default_rng(0), grouping.base(X), X.copy()
    last = places(grouping, grouping.standard.n - 1)
    given[last] *= mass / X[last[-1]]
    sigma = 1e-3 * np.maximum(np.abs(base), 0.01)
    correlated = np.eye(len(base)) + 0.1 * rng.normal(size=(len(base), len(base)))
    C = correlated @ correlated.T * np.outer(sigma, sigma)
    estimate = base + np.linalg.cholesky(C) @ rng.normal(size=len(base))
    found = consistent_parameters(grouping, estimate, C, given)
    assert np.abs(found.departure).max() < 1.5  # of a sigma, a file that is wrong by a factor of a hundred at least
    friction = [i for i, name in enumerate(grouping.names) if name.startswith(("Fv", "Fs"))]
    np.testing.assert_array_equal(found.base[friction], estimate[friction])


def test_a_link_too_slender_for_its_inertia_is_moved_as_little_as_its_sigma_asks(scara):
    """SCARA: ZZ2 must exceed (MX2^2 + MY2^2) / M2, whatever M2: with M2 free there are bodies; negative ZZ2 has none."""
    _, _, grouping, X = scara
    base, sigma = grouping.base(X), np.full(8, 1e-3)
    slender = base.copy()
    slender[grouping.names.index("ZZ2")] = 0.005  # below 0.0289 of 2 kg there
    found = consistent_parameters(grouping, slender, np.diag(sigma**2), X)
    assert found.agrees
    assert found.distance < 2  # sigma, for a mass of five times the file's
    assert min(np.linalg.eigvalsh(S)[0] for S in links(grouping, found.standard)) > 1e-5  # no thinner than that asks
    mass = dict(zip(found.names, found.standard, strict=True))["M2"]
    assert mass > (0.24**2 + 0.01**2) / 0.007  # two sigma above the estimate
    impossible = base.copy()
    impossible[grouping.names.index("ZZ2")] = -0.05
    assert not consistent_parameters(grouping, impossible, np.diag(sigma**2), X).agrees


def test_what_cannot_be_used_is_refused(robot):
    _, _, grouping, X = robot
    base, C = grouping.base(X), np.eye(len(grouping.names))
    with pytest.raises(IdentificationError, match="covariance of the estimate is not positive definite"):
        consistent_parameters(grouping, base, C - 2 * np.eye(len(C)), X)
    wrong = X.copy()
    wrong[grouping.standard.names.index("XX1")] = -1.0
    with pytest.raises(IdentificationError, match="link 1 of the given model is not physically consistent"):
        consistent_parameters(grouping, base, C, wrong)


def test_a_link_of_a_needle_is_left_with_room_for_the_solver(rng):
    """A given link with an eigenvalue of 1e-9 of its trace, estimates off by many sigma: no link ends outside of its cone."""
    _, _, grouping, X = arm("puma560")
    for j in (1, 5):
        mine = places(grouping, j)
        values, axes = np.linalg.eigh(pseudo_inertia(X[mine]))
        X[mine] = inertial((axes * np.maximum(values, [1e-9 * values.sum(), 0, 0, 0])) @ axes.T)
    for _ in range(5):
        base = grouping.base(X) * rng.uniform(0.3, 2, len(grouping.names))
        C = np.diag(1e-6 * np.maximum(np.abs(base), 1e-3) ** 2)
        found = consistent_parameters(grouping, base, C, X)
        for S in links(grouping, found.standard):
            assert np.linalg.eigvalsh(S)[0] > 1e-9 * np.trace(S)
        rewritten("puma560", dict(zip(found.names, found.standard, strict=True)))


def test_a_plate_is_given_some_thickness(scara):
    """Moments 0.1, 0.1 and 0.2: flat, as MuJoCo allows; an estimate near it is written all the same."""
    _, _, grouping, X = scara
    plate = {"XX": 0.1, "YY": 0.1, "ZZ": 0.2, "MX": 0.0, "XY": 0.0, "XZ": 0.0, "YZ": 0.0}
    X[[grouping.standard.names.index(f"{x}1") for x in plate]] = list(plate.values())
    found = consistent_parameters(grouping, grouping.base(X), 1e-6 * np.eye(8), X)
    assert found.agrees
    assert min(np.linalg.eigvalsh(S)[0] for S in links(grouping, found.standard)) > -1e-9


@pytest.mark.parametrize("robot", ["puma560"], indirect=True)
def test_rotors_that_the_file_lacks_take_what_is_constant_at_the_joint(robot):
    """Links of the file are a tenth too heavy; rotors of the first two joints are seen in sums with them alone."""
    _, _, grouping, X = robot
    names, given = grouping.standard.names, X.copy()
    rotors = [names.index(f"Ia{j + 1}") for j in range(6)]
    given[[k for k in range(len(X)) if names[k].rstrip("123456") in INERTIAL]] *= 1.1
    given[rotors] = 0.0
    base = grouping.base(X)
    found = consistent_parameters(grouping, base, np.diag((1e-4 * np.maximum(np.abs(base), 0.01)) ** 2), given)
    assert found.agrees
    np.testing.assert_allclose(found.standard[rotors], X[rotors], rtol=0.15)  # of joint 1, links make as much as the rotor
    masses = [names.index(f"M{j + 1}") for j in range(6)]
    np.testing.assert_allclose(found.standard[masses], given[masses], rtol=0.25)


def distance(S0, S):
    """tr(S0^-1 S) - ln det(S0^-1 S) - 4, by the eigenvalues of the ratio."""
    values = scipy.linalg.eigh(S, S0, eigvals_only=True)
    return float(np.sum(values - np.log(values) - 1))


@pytest.mark.parametrize("weight", [1e-4, 1.0, 100.0])
def test_no_other_bodies_agree_better(robot, rng, weight):
    """The objective, typed here by eigenvalues, does not fall along 40 directions to either side."""
    _, _, grouping, X = robot
    base = grouping.base(X)
    sigma = 0.02 * np.maximum(np.abs(base), 0.01)
    estimate = base + 3 * sigma * rng.standard_normal(len(base))
    found = consistent_parameters(grouping, estimate, np.diag(sigma**2), X, weight=weight)
    bodies = [i for i, p in enumerate(grouping.standard.parameters) if p.symbol in INERTIAL]
    given = list(links(grouping, X))

    def objective(x):
        off = (grouping.base(x) - estimate) / sigma
        away = sum(distance(S0, S) for S0, S in zip(given, links(grouping, x), strict=True))
        return np.sum(off**2) / 2 + weight * away

    least = objective(found.standard)
    for _ in range(40):
        step = np.zeros(len(X))
        step[bodies] = rng.standard_normal(len(bodies)) * np.abs(X[bodies]).max() * 1e-4
        for side in (step, -step):
            moved = found.standard + side
            if min(np.linalg.eigvalsh(S)[0] for S in links(grouping, moved)) > 0:
                assert objective(moved) > least - 1e-6 * max(1.0, least)


def test_a_given_model_of_unknown_size_takes_that_of_the_estimate(robot):
    """Tables have no bodies: those of a gram that stand for them would hold the whole estimate."""
    _, _, grouping, X = robot
    base = grouping.base(X)
    sigma = 1e-3 * np.maximum(np.abs(base), 0.01)
    dust = X.copy()
    for j in range(grouping.standard.n):
        dust[places(grouping, j)] *= 1e-6
    found = consistent_parameters(grouping, base, np.diag(sigma**2), dust)
    assert found.agrees
    assert np.abs(found.departure).max() < 0.1  # of a sigma


def test_a_large_rotor_does_not_make_bodies_heavier(scara, monkeypatch):
    """It is grouped with the first link's inertia; the bodies that are given are right, and are not taken for placeholders."""
    _, _, grouping, given = scara
    truth = given.copy()
    truth[grouping.standard.names.index("Ia1")] = 400.0
    base = grouping.base(truth)
    sigma = 1e-3 * np.maximum(np.abs(base), 0.01)
    found = consistent_parameters(grouping, base, np.diag(sigma**2), given)
    monkeypatch.setattr("idbench.identify.parameters.consistent.LARGER", np.inf)
    np.testing.assert_array_equal(found.standard, consistent_parameters(grouping, base, np.diag(sigma**2), given).standard)
