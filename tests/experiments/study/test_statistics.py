"""Statistics against known distributions and against SciPy by another way."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from scipy import stats

from idbench.experiments.study.answer import WORST, answer, headline, requirements, worst_runs
from idbench.experiments.study.statistics import SURE, Cell, cells, differences

TRUTH = np.array([2.0, -0.5])


def cell(error, model="explicit", sigma=None, failures=(), runs=None, settings=None):
    """A cell with the relative errors `error`, shape (runs, 2)."""
    error = np.asarray(error, dtype=float)
    absolute = error * np.abs(TRUTH)
    known = np.broadcast_to(np.abs(TRUTH) if sigma is None else sigma, error.shape)
    return Cell(
        settings={"fs": 1.0} if settings is None else settings,
        names=("chain", "OLS", model),
        parameters=("a", "b"),
        run=np.arange(len(error)) if runs is None else np.array(runs),
        X=TRUTH + absolute,
        sigma=known,
        paper_sigma=known / 2,
        truth=np.tile(TRUTH, (len(error), 1)),
        failures={reason: np.arange(number) for reason, number in failures},
    )


def test_bias_and_its_interval_are_those_of_the_t_test(rng):
    error = rng.normal([0.02, -0.01], [0.05, 0.2], (40, 2))
    found = cell(error)
    for p in range(2):
        interval = stats.ttest_1samp(error[:, p], 0.0).confidence_interval(0.95)
        assert found.bias[p] - found.bias_margin[p] == pytest.approx(interval.low)
        assert found.bias[p] + found.bias_margin[p] == pytest.approx(interval.high)
    np.testing.assert_allclose(found.rmse**2, found.bias**2 + found.deviation**2 * 39 / 40)


def test_the_interval_of_a_bias_holds_it_in_95_percent_of_cases(rng):
    """Over 1000 studies of 10 runs; binomial: 95 +- 2 % at three sigma."""
    inside = []
    for _ in range(1000):
        found = cell(rng.normal(0.3, 1.0, (10, 2)))
        inside.append(np.abs(found.bias - 0.3) < found.bias_margin)
    assert np.mean(inside, axis=0) == pytest.approx([0.95, 0.95], abs=0.02)


def test_coverage_of_normal_errors(rng):
    found = cell(rng.normal(0, 1.0, (20000, 2)))
    assert found.coverage(found.sigma) == pytest.approx([0.9545, 0.9545], abs=0.005)
    assert found.coverage(found.paper_sigma) == pytest.approx([0.6827, 0.6827], abs=0.01)
    low, high = found.coverage_interval(found.sigma).T
    assert (low < found.coverage(found.sigma)).all()
    np.testing.assert_allclose(high - low, 2 * 1.96 * np.sqrt(0.9545 * 0.0455 / 20000), rtol=0.05)


def test_typical_is_no_parameters_alone():
    assert cell(np.tile([0.01, 0.04], (3, 1))).typical == pytest.approx(0.02)


def test_models_are_compared_on_the_same_runs(rng):
    """An effect that two independent samples of this size would not show, since the runs differ far more than the models."""
    scale = np.exp(rng.normal(0, 1.0, (30, 1)))
    error = scale * rng.choice([-1, 1], (30, 2))
    good, bad = cell(error), cell(1.1 * error * np.exp(rng.normal(0, 0.02, (30, 2))), "power")
    (found,) = differences([good, bad])
    assert (found.better, found.worse, found.runs) == (good, bad, 30)
    assert found.ratio == pytest.approx(bad.typical / good.typical)
    assert found.ratio == pytest.approx(1.1, rel=0.02)
    assert found.p < 1e-4
    sizes = [np.log(np.abs(one.error)).mean(axis=1) for one in (good, bad)]
    assert stats.mannwhitneyu(*sizes).pvalue > 0.5


def test_equal_models_differ_as_often_as_chance_says(rng):
    """p below 0.05 in 5 +- 3 % of 300 studies without a difference."""
    p = [differences([cell(rng.normal(size=(25, 2))), cell(rng.normal(size=(25, 2)), "power")])[0].p for _ in range(300)]
    assert np.mean(np.array(p) < 0.05) == pytest.approx(0.05, abs=0.04)


def test_many_pairs_are_corrected(rng):
    """Holm: the smallest of three p is taken three times, the next twice, and none is smaller than one before it."""
    group = [cell(rng.normal(size=(25, 2)), name) for name in ("a", "b", "c")]
    plain = [differences([group[i], group[j]])[0].p for i, j in ((0, 1), (0, 2), (1, 2))]
    order = np.argsort(plain)
    expected = np.maximum.accumulate(np.minimum(1, np.array(plain)[order] * [3, 2, 1]))
    assert [differences(group)[i].p for i in order] == pytest.approx(list(expected))


def test_the_best_of_many_can_be_significant(rng):
    """22 methods make 231 pairs: the best differs from all others, which are alike."""
    group = [cell(rng.normal(size=(25, 2)) * (0.01 if k == 0 else 1.0), f"model {k}") for k in range(22)]
    sure = [d for d in differences(group) if d.p < SURE]
    assert len(sure) == 21
    assert all(d.better is group[0] for d in sure)


def test_only_runs_that_both_could_identify_are_compared():
    one, other = cell([[0.1, 0.1]] * 3, runs=[0, 1, 2]), cell([[0.2, 0.2]] * 3, "power", runs=[1, 2, 5])
    (found,) = differences([one, other])
    assert (found.better, found.runs) == (one, 2)
    assert found.ratio == pytest.approx(2.0)


def test_failures_are_counted_and_never_in_the_figures():
    rows = {
        "run": [0, 1, 2],
        "fs": [50.0] * 3,
        "chain": ["idbench"] * 3,
        "estimator": ["OLS"] * 3,
        "model": ["power"] * 3,
        "failure": [None, "left its range", None],
        "a": [1.1, None, 0.9],
        "a.sigma": [0.1, None, 0.1],
        "a.paper_sigma": [0.1, None, 0.1],
        "a.truth": [1.0, None, 1.0],
    }
    columns = {name: np.array(column, dtype=object) for name, column in rows.items()}
    (found,) = cells(columns, ["fs"], ("a",))
    assert found.runs == 2
    assert {reason: runs.tolist() for reason, runs in found.failures.items()} == {"left its range": [1]}
    assert found.rmse == pytest.approx([0.1])
    assert "1 of 3 identifications failed" in answer([found])


def test_the_answer_names_the_better_model_and_both_sigmas(rng):
    error = rng.normal(0, 1, (60, 2))
    group = [cell(error, "explicit", settings={"fs": f}) for f in (1.0, 2.0)]
    worse = [cell(3 * error, "power", settings={"fs": f}) for f in (1.0, 2.0)]
    printed = answer([group[0], worse[0], group[1], worse[1]])
    assert printed.startswith("Least typical error: explicit, best in all 2 settings (p")
    assert printed.count(". ") == 1  # two sentences
    few = [cell(error[:4], "explicit"), cell(3 * error[:4], "power")]
    assert answer(few).startswith("Least typical error in 1 of 1 settings: explicit (too few runs for a test)")
    assert "The true value lies within two standard errors in" in printed


def test_an_answer_without_estimates():
    assert answer([cell(np.zeros((0, 2)), failures=[("why", 1)])]).startswith("No run gave an estimate. 1 of 1")


def test_reasons_that_differ_in_numbers_alone_are_one():
    rows = {name: np.array([1.0] * 3) for name in ("a", "a.sigma", "a.paper_sigma", "a.truth")}
    reasons = ["left its range at 1.2 s (seed 5)", "left its range at 13 s (seed 71)", "no torque"]
    words = {name: np.array([name] * 3, dtype=object) for name in ("chain", "estimator", "model")}
    rows |= words | {"run": np.array([4, 7, 9]), "fs": np.ones(3), "failure": np.array(reasons, dtype=object)}
    (found,) = cells(rows, ["fs"], ("a",))
    assert {reason: runs.tolist() for reason, runs in found.failures.items()} == {reasons[0]: [4, 7], "no torque": [9]}
    assert found.failed == 3


def test_the_answer_names_the_least_error_of_its_own_table(rng):
    """One wild run in thirty makes the rms of the otherwise better model the larger one: the table and the answer agree."""
    error = rng.normal(0, 0.01, (30, 2))
    wild = error.copy()
    wild[0] = 10.0
    one, other = cell(wild), cell(3 * error, "power")
    assert other.typical < one.typical
    printed = answer([one, other])
    assert printed.startswith("Least typical error: power and explicit; no significant difference between them")
    assert f"its typical error is {100 * other.typical:.2g} %" in printed


def test_the_probability_is_that_of_all_exchanges(rng):
    """Of eight runs, all 256 exchanges of errors between the two: the share with as large a ratio."""
    one, other = cell(rng.normal(0, 1, (8, 2))), cell(rng.normal(0, 2, (8, 2)), "power")
    (found,) = differences([one, other])
    counted = 0
    for swapped in product([False, True], repeat=8):
        where = np.array(swapped)[:, None]
        a, b = np.where(where, other.error, one.error), np.where(where, one.error, other.error)
        ratio = cell(a).typical / cell(b).typical
        counted += max(ratio, 1 / ratio) >= found.ratio * (1 - 1e-9)
    share = counted / 256
    # Of 20 000 draws, or of as many as it takes to see 200 such ratios.
    assert found.p == pytest.approx(share, abs=4 * max(np.sqrt(share / 20_000), share / np.sqrt(200)))


def test_lowest_in_all_and_sure_in_some_is_said_so(rng):
    """Power errs least in six of six combinations; in two the difference is not significant."""
    cells = []
    for k in range(6):
        error = rng.normal(0, 1, (40, 2))
        noise = np.exp(rng.normal(0, 0.05 if k < 4 else 2.0, (40, 2)))
        explicit = cell(1.1 * error * noise, settings={"fs": float(k)})
        power = cell(error, "power", settings={"fs": float(k)})
        while differences([explicit, power])[0].better is not power:
            explicit = replace(explicit, X=TRUTH + 1.05 * (explicit.X - TRUTH))
        cells += [explicit, power]
    printed = answer(cells)
    assert printed.startswith("Least typical error: power, best in all 6 settings (p < 0.01)")


def test_the_only_model_with_estimates_is_not_called_better(rng):
    error = rng.normal(0, 0.01, (30, 2))
    settings = [{"fs": 1.0}, {"fs": 2.0}]
    group = [cell(error, settings=settings[0]), cell(error, "power", settings=settings[0]), cell(error, settings=settings[1])]
    assert "the only one with an estimate in 1" in answer(group)


def test_what_has_no_sigma_is_neither_inside_nor_outside(rng):
    sigma = np.full((40, 2), 10.0)
    sigma[:30, 0] = np.nan
    sigma[:, 1] = np.nan
    found = cell(rng.normal(0, 1, (40, 2)), sigma=sigma)
    assert found.coverage(found.sigma)[0] == 1
    assert found.coverage_interval(found.sigma)[0, 0] == pytest.approx(
        stats.binomtest(10, 10).proportion_ci(method="wilson").low
    )
    assert np.isnan(found.coverage(found.sigma)[1])
    assert np.isnan(found.coverage_interval(found.sigma)[1]).all()


def test_a_truth_of_zero_has_no_relative_error():
    found = replace(cell([[0.1, 0.3], [0.1, -0.3]]), truth=np.array([[2.0, 0.0]] * 2))
    assert np.isnan(found.rmse[1])
    assert found.typical == pytest.approx(0.1)


def test_a_combination_that_another_does_not_surely_win_does_not_count_against(rng):
    """Explicit is significantly better in four; in two power errs less by a per cent or so, which is no difference."""
    cells = []
    for k in range(6):
        error = rng.normal(0, 1, (40, 2))
        other = 1.5 * error * np.exp(rng.normal(0, 1.0, (40, 2)))
        explicit, power = (cell(e, model, settings={"fs": float(k)}) for e, model in ((error, "explicit"), (other, "power")))
        while k < 4 and differences([explicit, power])[0].p > 1e-4:
            power = replace(power, X=TRUTH + 1.5 * (power.X - TRUTH))
        while k >= 4 and differences([explicit, power])[0].better is not power:
            power = replace(power, X=TRUTH + 0.97 * (power.X - TRUTH))
        cells += [explicit, power]
    printed = answer(cells)
    assert "explicit, best or not significantly worse in 6 of 6 settings, best in 4 (p < 0.01)" in printed


def test_the_interval_of_the_typical_error_holds_it(rng):
    """Of normal errors of the size 1, in nearly 95 % of samples of 60 runs."""
    inside = 0
    for _ in range(200):
        low, high = cell(rng.normal(0, 1, (60, 2)) * TRUTH).typical_interval
        inside += low <= 1 <= high
    assert 0.87 <= inside / 200 <= 0.985  # the bootstrap's ends are a little close; two sigma of 200 draws


def test_the_first_line_has_the_errors_of_the_method_that_it_names():
    """Explicit errs 1 and 4 %, power 2 and 3 %: the errors are explicit's, which is least in one of two."""
    sizes = {("a", "explicit"): 0.01, ("a", "power"): 0.02, ("b", "explicit"): 0.04, ("b", "power"): 0.03}
    cells = [cell(size * np.ones((20, 2)) * TRUTH, model, settings={"noise": x}) for (x, model), size in sizes.items()]
    assert headline(cells) == "least with explicit in 1 of 2 settings: typical errors 1 % to 4 %"


def test_the_worst_runs_are_of_several_combinations():
    """Twenty bad runs of one combination do not hide the worst of a better one; no run is there twice."""
    bad = cell(np.linspace(5, 1, 40).reshape(20, 2) * TRUTH, settings={"fs": 1.0})
    good = cell(0.01 * np.ones((20, 2)) * TRUTH, settings={"fs": 2.0})
    found = worst_runs([bad, replace(good, run=good.run + 20)])
    assert [each[0].settings["fs"] for each in found[:2]] == [1.0, 2.0]
    assert len({each[3] for each in found}) == len(found) == WORST


def test_what_an_error_takes_is_said_with_the_bits_of_an_encoder(rng):
    errors = {256.0: 0.2, 1024.0: 0.03, 4096.0: 0.004, 16384.0: 0.0005}
    group = [cell(size * TRUTH * rng.normal(0, 1, (400, 2)), settings={"encoder.lines": x}) for x, size in errors.items()]
    asked = "a typical error of 1 % requires encoder.lines of at least 4096 (14 bits), 0.1 % 16384"
    assert requirements(group).startswith(asked)
    rising = [replace(c, settings={"torque.noise": 1 / c.settings["encoder.lines"]}) for c in group]
    assert "1 % requires torque.noise of at most 0.000244141, 0.1 % 6.10352e-05" in requirements(rising)
    assert requirements(group[:1]) == ""
