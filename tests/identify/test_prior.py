"""What is roughly known: rows of the normal equations, of every linear estimator."""

import builders
import numpy as np
import pytest
from builders import arm

from idbench.identify import (
    ESTIMATORS,
    MODELS,
    BaseParameters,
    IdentificationError,
    MotionLog,
    Problem,
    TorqueChannel,
    estimate,
    idbench_chain,
)
from idbench.identify.basis import CoulombFriction, Offset, ViscousFriction, tree_basis
from idbench.identify.data.kinematics import INERTIAL
from idbench.identify.parameters.bodies import inertial, pseudo_inertia
from idbench.identify.parameters.prior import FilePrior, evident_sizes, normal_prior, prior_sum
from idbench.identify.rows.factors import prior_rows

LINEAR = ["OLS", "WLS", "GLS"]


@pytest.fixture(scope="module")
def grouping():
    return arm("scara").grouping


@pytest.fixture(scope="module")
def values():
    return arm("scara").X


def problem_of(log, grouping, prior=None):
    return Problem((log,), grouping.basis, MODELS.create("explicit"), idbench_chain(), prior=prior)


@pytest.fixture(scope="module")
def noisy(log):
    return builders.noisy(log, 0, [0.5, 0.025], rng=4)


@pytest.mark.parametrize("acronym", LINEAR)
def test_a_value_and_its_sigma_are_one_more_measurement(noisy, grouping, acronym):
    """Fs2 0.12 +- 0.002 beside what the log says, as the mean of two numbers by their variances: closed form.

    Of OLS, whose rows count alike, the prior's size is that of the residual, and the mean is that of its own weights.
    """
    k = grouping.names.index("Fs2")
    plain = estimate(problem_of(noisy, grouping), ESTIMATORS.create(acronym))
    prior = normal_prior(np.eye(8)[:, k : k + 1], np.array([0.12]), np.array([0.002]))
    found = estimate(problem_of(noisy, grouping, prior), ESTIMATORS.create(acronym))
    rows = found.solution.known
    unit = rows[0, k] * 0.002  # 1 where rows are divided by their noise
    inverse = plain.solution.inverse * unit**2
    mean = (plain.X[k] / inverse[k, k] + 0.12 / 0.002**2) / (1 / inverse[k, k] + 1 / 0.002**2)
    near = 5e-2 if acronym == "WLS" else 1e-5  # its weights are those of other residuals
    assert found.X[k] == pytest.approx(mean, rel=near)
    gain = inverse[:, k] / (inverse[k, k] + 0.002**2)
    np.testing.assert_allclose(found.X, plain.X + gain * (0.12 - plain.X[k]), rtol=near)
    if acronym == "GLS":
        np.testing.assert_allclose(np.diag(found.own_covariance)[k], 1 / (1 / inverse[k, k] + 1 / 0.002**2), rtol=1e-4)


@pytest.mark.thorough
def test_sigma_is_right_where_the_prior_is(log, grouping, values):
    """200 values drawn from the prior, and 200 noises: the errors of a log of 10 s over sigma are 1 within a seventh."""
    rng, short, z = np.random.default_rng(2), log.part(0, 1000), []
    places = [grouping.names.index(name) for name in ("Fv1", "Fs1", "Fv2", "Fs2")]
    true = grouping.base(values)
    sigma = 0.3 * np.abs(true[places])
    for _ in range(200):
        believed = true[places] + sigma * rng.standard_normal(len(places))
        prior = normal_prior(np.eye(8)[:, places], believed, sigma)
        one = builders.noisy(short, 0, [5.0, 0.25], rng=rng)
        found = estimate(problem_of(one, grouping, prior), ESTIMATORS.create("GLS"))
        z.append((found.X - true) / found.noise_sigma)
    assert np.sqrt(np.mean(np.square(z))) == pytest.approx(1.0, abs=0.15)


def test_what_is_grouped_with_something_unknown_is_not_known(grouping, values):
    """ZZR1 = ZZ1 + Ia1 + 0.25 M2: known when all three are."""
    K, names = grouping.K, grouping.standard.names
    sigma = np.full(len(names), np.inf)
    sigma[names.index("Ia1")] = 0.1
    assert not len(normal_prior(K, values, sigma)(np.eye(len(K) + 1)))
    sigma[[names.index("ZZ1"), names.index("M2")]] = 0.2, 0.4
    (row,) = normal_prior(K, values, sigma)(np.eye(len(K) + 1))
    variance = 0.1**2 + 0.2**2 + (0.25 * 0.4) ** 2
    assert row[grouping.names.index("ZZR1")] == pytest.approx(1 / np.sqrt(variance))
    assert row[-1] * np.sqrt(variance) == pytest.approx(3.5)


@pytest.mark.parametrize("acronym", LINEAR)
def test_links_near_the_file_are_consistent_and_the_log_wins_where_it_knows(noisy, grouping, values, acronym):
    wrong = values.copy()
    for i, p in enumerate(grouping.standard.parameters):
        wrong[i] *= 1.3 if p.symbol not in ("Fv", "Fs", "Ia") else 1.0
    plain = estimate(problem_of(noisy, grouping), ESTIMATORS.create(acronym))
    loose, tight = (
        estimate(
            problem_of(noisy, grouping, FilePrior(grouping.K, grouping.standard.parameters, wrong, share)),
            ESTIMATORS.create(acronym),
        )
        for share in (10.0, 1e-4)
    )
    np.testing.assert_allclose(loose.X, plain.X, atol=0.02 * plain.own_sigma.max())
    k = grouping.names.index("ZZ2")
    assert tight.X[k] == pytest.approx(grouping.base(wrong)[k], rel=3e-2)


def test_the_rows_of_a_file_solve_to_bodies_that_exist(noisy, grouping, values):
    """The solution of R and the rows is K x with positive pseudo-inertias, and does not change when it is linearized again."""
    prior = FilePrior(grouping.K, grouping.standard.parameters, values, 0.2)
    found = estimate(problem_of(noisy, grouping, prior), ESTIMATORS.create("GLS"))
    R = found.problem.independent_factor
    again = np.linalg.lstsq(np.concatenate([R[:, :-1], (rows := prior_rows(prior, R, np.ones(())))[:, :-1]]),
                            np.concatenate([R[:, -1], rows[:, -1]]))[0]  # fmt: skip
    np.testing.assert_allclose(found.X, again, rtol=1e-8)
    body = dict(zip(grouping.names, found.X, strict=True))
    S = pseudo_inertia(np.array([0.03, 0, 0, 0.03, 0, body["ZZ2"], body["MX2"], body["MY2"], 0, 2.0]))
    assert np.linalg.eigvalsh(S[np.ix_([0, 1, 3], [0, 1, 3])])[0] > 0


def test_a_log_that_determines_nothing_has_an_estimate_with_a_prior(log, grouping, values):
    """Two seconds, of which few rows are not masked."""
    short = log.part(100, 390)
    with pytest.raises(IdentificationError):
        estimate(problem_of(short, grouping), ESTIMATORS.create("WLS"))
    prior = FilePrior(grouping.K, grouping.standard.parameters, values, 0.1)
    found = estimate(problem_of(short, grouping, prior), ESTIMATORS.create("WLS"))
    assert found.X[grouping.names.index("ZZ2")] == pytest.approx(0.06, rel=0.3)


def test_several_priors_add(grouping, values):
    friction = normal_prior(np.eye(8)[:, [1]], np.array([0.05]), np.array([0.01]))
    links = FilePrior(grouping.K, grouping.standard.parameters, values, 0.2)
    R = np.diag([1e2] * 9)
    both = prior_sum((friction, links))(R)
    assert len(both) == len(friction(R)) + len(links(R))


@pytest.mark.parametrize("acronym", ["TLS", "IRLS", "ML"])
def test_estimators_that_take_no_prior_say_so(noisy, grouping, acronym):
    prior = normal_prior(np.eye(8)[:, [1]], np.array([0.05]), np.array([0.01]))
    with pytest.raises(IdentificationError, match="takes nothing that is known before: use GLS, WLS or OLS"):
        estimate(problem_of(noisy, grouping, prior), ESTIMATORS.create(acronym))


@pytest.mark.parametrize("acronym", LINEAR)
def test_the_part_of_the_prior_is_what_a_change_of_it_makes(noisy, grouping, acronym):
    """of_prior = sum of squares of what X moves by when each believed value moves by its sigma."""
    places = [grouping.names.index(name) for name in ("Fs1", "Fs2")]
    values, sigma = np.array([0.5, 0.1]), np.array([0.05, 0.002])

    def fit(change):
        prior = normal_prior(np.eye(8)[:, places], values + change, sigma)
        return estimate(problem_of(noisy, grouping, prior), ESTIMATORS.create(acronym))

    base = fit(np.zeros(2))
    moved = [(fit(0.01 * sigma * unit).X - base.X) / 0.01 for unit in np.eye(2)]
    expected = sum(np.outer(x, x) for x in moved)
    near = 0.1 if acronym == "WLS" else 1e-3  # whose weights move with the residuals
    np.testing.assert_allclose(np.diag(base.solution.of_prior), np.diag(expected), rtol=near, atol=1e-12)


def test_thin_links_are_known_in_all_directions(noisy, grouping, values):
    """A rod: its best-known directions stay known, and the solution is that of bodies."""
    rod, first = values.copy(), grouping.standard.names
    for j in (1, 2):
        S = np.diag([0.2, 1e-8, 1e-8, 0.0]) + 2 * np.outer(c := np.array([0.25, 0.0, 0.0, 1.0]), c)
        rod[[first.index(f"{x}{j}") for x in INERTIAL]] = inertial(S)
    prior = FilePrior(grouping.K, grouping.standard.parameters, rod, 0.1)
    R = problem_of(noisy, grouping).independent_factor
    rows = prior(R)
    assert np.linalg.matrix_rank(rows[:, :-1]) == len(rows)


def test_noise_levels_are_in_newton_metres_whatever_the_gain(noisy, grouping):
    scaled = MotionLog(noisy.fs, noisy.q, noisy.tau / 10, TorqueChannel(noisy.torque.meaning, noisy.torque.delay, 10.0))
    one, other = (problem_of(log, grouping).noise.torque for log in (noisy, scaled))
    np.testing.assert_allclose(one, other, rtol=1e-6)


def test_sizes_are_those_that_parameters_were_drawn_with():
    """Two groups of 100, drawn with sizes 0.1 and 3, beside 5 that are free: sizes are found within 2.5 / sqrt(200)."""
    rng, sizes = np.random.default_rng(0), np.array([0.1, 3.0])
    groups = [np.arange(5, 105), np.arange(105, 205)]
    x = np.concatenate([10 * rng.standard_normal(5), *(size * rng.standard_normal(100) for size in sizes)])
    W = rng.standard_normal((2000, 205))
    rows = np.column_stack([W, W @ x + rng.standard_normal(2000)])
    found = evident_sizes(rows, groups, np.array([10.0, 10.0]))
    np.testing.assert_allclose(found, sizes, rtol=2.5 / np.sqrt(200))


def test_a_joint_that_turned_one_way_has_friction_where_the_others_show_no_offset(noisy, values):
    """Joint 2 always forwards: Fs2 and off2 make the same column; joint 1 shows an offset of 0, or one of 5 N m."""
    tree = arm("scara").tree
    grouping = BaseParameters.of(tree, tree_basis(tree, (ViscousFriction(), CoulombFriction(), Offset())))
    standard, names = grouping.standard, grouping.names
    given = np.array([dict(zip(tree_basis(tree).names, values, strict=True)).get(name, 0.0) for name in standard.names])
    prior, found = FilePrior(grouping.K, standard.parameters, given, 0.2), {}
    R = problem_of(noisy, grouping).independent_factor
    R[:, names.index("Fs2")] = R[:, names.index("off2")]
    for offset in (0.0, 5.0):
        true = grouping.base(given)
        true[names.index("off1")] = offset
        Y = R[:, :-1] @ true
        Y[-1] = R[-1, -1]  # the noise
        measured = np.column_stack([R[:, :-1], Y])
        known = np.concatenate([measured, prior(measured)])
        found[offset] = dict(zip(names, np.linalg.lstsq(known[:, :-1], known[:, -1])[0], strict=True))
        assert found[offset]["Fs2"] + found[offset]["off2"] == pytest.approx(true[names.index("Fs2")], abs=0.002)
        assert found[offset]["off1"] == pytest.approx(offset, abs=0.01)
    assert abs(found[0.0]["off2"]) < 0.01 * found[0.0]["Fs2"]
    assert abs(found[5.0]["off2"]) > 0.01 * found[5.0]["Fs2"]
