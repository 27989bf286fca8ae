"""Studies with as many rows for every model, ideal data, settings that go together, or a bound; and the ratios of errors."""

import json

import numpy as np
import pytest
import tomli_w

from idbench.experiments.cli import main
from idbench.experiments.study.axis import Axis
from idbench.experiments.study.ratios import conclusion, ratio
from idbench.experiments.study.shard import run_shard
from idbench.experiments.study.statistics import Cell
from idbench.experiments.study.study_file import study_from
from idbench.identify import MODELS, ExplicitModel, PowerModel, idbench_chain, identify, identify_each, scara
from idbench.identify.models import THREE
from idbench.identify.rows.operators import Windows
from idbench.sim.encoders import AbstractEncoder, IncrementalEncoder
from idbench.sim.errors import ScenarioError

EVERY = ["explicit", "implicit", "power", "energy", "integral"]


@pytest.fixture
def equal(content):
    return study_from(
        {**content, "seeds": 2, "models": EVERY, "rows": "equal", "axes": [{"field": "encoder.lines", "values": [65536]}]},
        "study",
    )


def test_every_model_has_as_many_rows(equal):
    """Power and energy have one row at an instant, the others two: they get twice the logs."""
    rows = run_shard(equal, range(1)).rows
    found = {row["model"]: row["rows"] for row in rows}
    assert found["explicit"] == found["implicit"] == pytest.approx(found["power"], rel=0.1)  # but for those near reversals
    assert found["energy"] > found["integral"]  # of which windows that touch a reversal are void
    assert {name: equal.logs_of(name) for name in EVERY} == {
        "explicit": 1,
        "implicit": 1,
        "power": 2,
        "energy": 2,
        "integral": 1,
    }


def test_realizations_have_other_noise_and_the_first_is_the_run_alone(equal, content):
    alone = study_from({**content, "seeds": 2, "models": ["explicit"], "axes": equal.content["axes"]}, "study")
    own, among = (run_shard(study, range(1)).rows[0] for study in (alone, equal))
    assert own["ZZR1"] == among["ZZR1"]
    assert len(set(equal.seeds_of(0))) == 2
    assert equal.seeds_of(0)[0] == equal.scenario_of(0).seed == alone.scenario_of(0).seed


def test_more_logs_make_errors_smaller(content):
    """Four realizations halve the standard errors of noise; of one short log the jackknife has a few stretches, and is wide."""
    few, many = (
        study_from({**content, "models": ["explicit"], "realizations": k, "axes": content["axes"][:1]}, "study") for k in (1, 4)
    )
    one, four = (run_shard(study, range(1)).rows[0]["ZZR1.sigma"] for study in (few, many))
    assert one / 5 < four < 1.3 * one / 2


def test_ideal_data_are_exact(content):
    """Of noise-free moves along polynomials nothing is left of chain idbench's errors."""
    content["settings"] = {"trajectory": content["settings"]["trajectory"]}
    study = study_from({**content, "data": "ideal", "axes": [{"field": "chain.trim", "values": [0.6]}]}, "study")
    for row in run_shard(study, range(2)).rows:
        assert row["ZZR1"] == pytest.approx(row["ZZR1.truth"], rel=1e-6)


def test_cases_are_settings_that_go_together(content):
    cases = {"coarse": {"encoder": {"lines": [512]}, "torque": {"noise": [0.2]}}, "fine": {"encoder": {"lines": [65536]}}}
    study = study_from({**content, "axes": [{"field": "noise", "cases": cases}]}, "study")
    scenarios = [point.scenario for point in study.points]
    assert [s.encoder.lines for s in scenarios] == [(512.0,), (65536.0,)]
    assert [s.torque.noise for s in scenarios] == [(0.2,), (0.1, 0.01)]
    assert study_from(study.content, "study").fingerprint == study.fingerprint
    with pytest.raises(ValueError, match="one of them"):
        Axis(field="noise", values=(1,), cases=cases)


def test_a_stage_with_its_settings_is_a_value(content):
    stages = [{"kind": "windows", "length": 0.3}, "fir", {"kind": "iir", "order": 1}]
    study = study_from({**content, "axes": [{"field": "chain.operator", "values": stages}]}, "study")
    assert study.methods[0].method.chain.operator == Windows(0.3)
    assert study.methods[2].method.chain.operator.order == 1
    assert [method.settings[0].label for method in study.methods] == ["windows, length 0.3", "fir", "iir, order 1"]


def test_energy_is_power_over_windows(log):
    """The model takes the windows of its chain, or those of 0.1 s; noise is that of the explicit model's own rows."""
    chain = idbench_chain()
    found = identify_each(log, scara(), {name: MODELS.create(name) for name in EVERY}, chain)
    alone = identify(log, scara(), MODELS.create("energy"), chain)
    np.testing.assert_array_equal(found["energy"].X, alone.X)
    assert found["energy"].problem.own_chain.operator == Windows(0.1)
    assert found["power"].problem.own_chain == chain
    assert tuple(EVERY[:3]) == THREE
    assert found["energy"].problem.model == PowerModel(integrated=True)
    assert not ExplicitModel().integrated


def cell(name, X):
    runs = len(X)
    ones = np.ones((runs, 1))
    return Cell({}, ("c", "OLS", name), ("a",), np.arange(runs), X[:, None], ones, ones, ones, {})


def test_a_ratio_of_known_errors_lies_in_its_interval():
    """Errors of power are three times as large: of 300 draws some 95 % of intervals contain 3."""
    rng = np.random.default_rng(0)
    inside = 0
    for _ in range(60):
        one, other = (cell(name, 1 + size * rng.standard_normal(200)) for name, size in (("power", 0.3), ("explicit", 0.1)))
        found = ratio(one, other)
        assert found["low"] < found["ratio"] < found["high"]
        inside += found["low"] <= 3.0 <= found["high"]
    assert inside >= 50  # of 60, 57 are expected, with a standard deviation of 1.7


def test_models_of_equal_rows_leave_out_the_same_time(content):
    """The filter of the paper's chain remembers longer than a window: the energy model does not get more of the log."""
    study = study_from(
        {**content, "seeds": 2, "models": EVERY, "rows": "equal", "chains": ["paper"], "axes": content["axes"][:1]}
        | {"settings": content["settings"] | {"trajectory": content["settings"]["trajectory"] | {"moves": 8}}},
        "study",
    )
    found = {row["model"]: row["rows"] for row in run_shard(study, range(1)).rows}
    assert len(set(found.values())) == 1


def test_a_case_is_not_changed_by_another_axis(content):
    """A study that is read again is the same, whatever its points were changed to."""
    cases = {"a": {"controller": {"kind": "computed_torque"}}, "b": {}}
    axes = [{"field": "law", "cases": cases}, {"field": "controller.bandwidth", "values": [[9.0], [20.0]]}]
    study = study_from({**content, "axes": axes}, "study")
    before = study.text
    assert len(study.points) == 4
    assert study_from(study.content, "study").text == before
    assert cases == {"a": {"controller": {"kind": "computed_torque"}}, "b": {}}


def test_the_sentences_need_no_chain_or_estimator_of_their_own():
    """Whatever a study has of the ratios is said, and nothing else."""
    row = {"settings": {"noise": "quiet"}, "chain": "paper", "estimator": "GLS", "ratio": 2.0, "low": 1.5, "high": 3.0}
    assert conclusion([]) == ""
    assert "2 to 2 times" in conclusion([row | {"models": ["power", "explicit"]}])
    assert "no advantage" not in conclusion([row | {"models": ["implicit", "explicit"], "ratio": 0.3}])


@pytest.mark.thorough
def test_the_bound_stands_beside_the_errors(content, tmp_path, capsys):
    """Of a study of nine runs: below the error of WLS, in the table, the summary and the report."""
    content["settings"]["trajectory"]["moves"] = 6
    axes = [{"field": "encoder.lines", "values": [2048]}]
    path = tmp_path / "small.toml"
    path.write_text(tomli_w.dumps(content | {"models": ["explicit"], "estimators": ["WLS"], "bound": True, "axes": axes}))
    assert main(["study", str(path), "--out", str(tmp_path / "out"), "--no-rerun"]) == 0
    assert "bound" in capsys.readouterr().out
    (cell,) = json.loads((tmp_path / "out" / "summary.json").read_text())["cells"]
    ratio = np.array(cell["rmse_percent"]) / cell["bound_percent"]
    assert (ratio > 0.5).all()  # nine runs know an rms to a quarter
    assert np.exp(np.mean(np.log(ratio))) > 1
    assert (np.array(cell["bound_through_reversals_percent"]) < cell["bound_percent"]).all()
    assert "<th>bound</th>" in (tmp_path / "out" / "report.html").read_text()


def test_an_encoder_that_does_not_say_what_noise_it_has_is_named():
    class Odd(AbstractEncoder):
        def start(self, n, samples, fs, rngs):
            raise NotImplementedError

    with pytest.raises(ScenarioError, match=r"encoder Odd has no spread\(2\), which a study with bound = true needs"):
        Odd().spread(2)


def test_counts_noise_and_converter_add_up():
    spread = IncrementalEncoder(lines=(1024, 4096), noise=1e-4).spread(2)
    np.testing.assert_allclose(spread, np.hypot(2 * np.pi / np.array([4096, 16384]) / np.sqrt(12), 1e-4))
