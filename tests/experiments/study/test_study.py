"""What a study makes of its file: runs, seeds, methods; and what it refuses."""

import itertools
import json
import re
import tomllib
from dataclasses import replace

import numpy as np
import pytest

from idbench.experiments.errors import StudyError
from idbench.experiments.study.axis import Axis
from idbench.experiments.study.study_file import load_study, names, study_from
from idbench.identify import IirLowPass, NoMask
from idbench.sim.drives import AveragedDrive

LINES = {"field": "encoder.lines", "values": [2048]}
RANDOM = {"kind": "random", "moves": 3}
QUINTIC = {"kind": "quintic", "waypoints": [[0.0, 0.0], [1.0, 1.0]], "durations": [1.0], "rest": 0.5}


def axes(content, *more, **first):
    """Return the study with the fields of its first axis changed, and more axes."""
    return content | {"axes": [content["axes"][0] | first, *more]}


def test_the_grid_is_every_combination(content):
    study = study_from(axes(content, {"field": "fs", "values": [50.0, 100.0, 200.0]}), "study")
    assert study.size == 2 * 3 * 9
    found = [(p.scenario.encoder.lines[0], p.scenario.fs) for p in study.points]
    assert found == list(itertools.product([2048, 65536], [50.0, 100.0, 200.0]))


def test_identification_is_varied_on_the_same_simulations(small):
    assert small.size == 18
    assert [method.method.chain.operator.cutoff for method in small.methods] == [4.0, 5.0]


def test_stages_are_chosen_by_name_and_fields_go_together(content):
    more = [
        {"field": "chain.operator", "values": ["iir"]},
        {"field": "chain.mask", "values": ["none", "reversal"]},
        {"field": "estimator.rounds", "values": [1, 3]},
        {"field": "chain.operator.cutoff", "values": [2.0, 3.0], "also": ["chain.trim"]},
    ]
    methods = study_from({**axes(content, *more), "estimators": ["WLS"]}, "study").methods
    assert len(methods) == 8
    assert all(isinstance(method.method.chain.operator, IirLowPass) for method in methods)
    assert {type(method.method.chain.mask) for method in methods} > {NoMask}
    assert {method.method.estimator.rounds for method in methods} == {1, 3}
    assert all(method.method.chain.trim == method.method.chain.operator.cutoff for method in methods)


def test_a_part_of_another_kind_replaces_the_base_scenarios(content):
    content["settings"]["drive"] = {"kind": "averaged", "bandwidth": 500.0}
    assert study_from(content, "study").points[0].scenario.drive == AveragedDrive(bandwidth=500.0)


def test_a_part_that_is_chosen_does_not_undo_what_is_set_in_it(content):
    """Whatever the order of the axes."""
    cutoff, stage = (
        {"field": "chain.operator.cutoff", "values": [2.0, 4.5]},
        {"field": "chain.operator", "values": ["fir", "iir"]},
    )
    for order in ([cutoff, stage], [stage, cutoff]):
        methods = study_from(content | {"axes": order}, "study").methods
        assert sorted((type(m.method.chain.operator).__name__, m.method.chain.operator.cutoff) for m in methods) == [
            ("FirLowPass", 2.0),
            ("FirLowPass", 4.5),
            ("IirLowPass", 2.0),
            ("IirLowPass", 4.5),
        ]


def test_values_are_numbers_or_words_but_not_both(content):
    noise = study_from(axes(content, field="torque.noise", values=[0.1, [0.1, 0.01]]), "study").axes[0]
    assert not noise.numeric
    assert [noise.label(x) for x in noise.points] == ["0.1", "[0.1, 0.01]"]
    assert Axis(field="x", values=[True, False]).numeric is False


def test_a_range_is_even(content):
    linear = Axis(field="fs", lowest=50.0, highest=200.0, count=4)
    log = Axis(field="fs", lowest=1.0, highest=1000.0, count=4, spacing="log")
    np.testing.assert_allclose(linear.points, [50, 100, 150, 200])
    np.testing.assert_allclose(log.points, [1, 10, 100, 1000])


def test_every_run_has_seeds_of_its_own(small):
    """For noise and for motion; those of numpy.random.SeedSequence, and the same whatever is asked first."""
    scenarios = [small.scenario_of(run) for run in reversed(range(small.size))][::-1]
    seeds = [s.seed for s in scenarios] + [s.trajectory.seed for s in scenarios]
    assert len(set(seeds)) == 2 * small.size
    point, number = 1, 4
    first, second = np.random.SeedSequence(0, spawn_key=(point, number)).generate_state(2, np.uint64) >> np.uint64(1)
    assert (scenarios[13].seed, scenarios[13].trajectory.seed) == (int(first), int(second))


def test_more_seeds_keep_the_runs_that_there_were(small):
    more = replace(small, seeds=20)
    for point, number in ((0, 3), (1, 8)):
        assert more.scenario_of(20 * point + number) == small.scenario_of(9 * point + number)


def test_shared_motion_is_the_scenarios(content):
    study = study_from(content | {"motion": "shared"}, "study")
    assert study.scenario_of(3).trajectory == study.scenario_of(17).trajectory


def test_text_and_toml_say_it_all(small):
    again = study_from(json.loads(small.text), "study")
    assert again == small
    assert again.fingerprint == small.fingerprint
    assert replace(small, seeds=8).fingerprint != small.fingerprint


@pytest.mark.parametrize("name", names())
def test_every_study_that_ships_can_be_run(name):
    study = load_study(name)
    assert study.name == name
    assert study.question.endswith("?")
    assert len(study.points) * study.seeds == study.size
    assert study.methods


def test_there_is_no_run_beyond_the_last(small):
    with pytest.raises(StudyError, match="run 18 does not exist: the study 'small' has runs 0 to 17"):
        small.scenario_of(18)


def test_a_missing_scenario_is_said_to_be_missing(content):
    del content["scenario"]
    with pytest.raises(StudyError, match="key 'scenario' is missing"):
        study_from(content, "study")


def test_the_example_of_the_docs_is_a_study(root):
    (example,) = re.findall(r"```toml\n(.*?)```", (root / "docs" / "studies.md").read_text(), re.DOTALL)
    study = study_from(tomllib.loads(example), "study")
    assert study.size == 3 * 3 * 2 * 64
    assert len(study.methods) == 2 * 2


def test_a_study_may_be_of_any_arm_but_of_one(content):
    content["settings"]["robot"] = "panda"
    study = study_from(axes(content, field="fs", values=[50.0]), "study")
    assert len(study.parameters) == 62
    assert study.parameters[0] == "ZZR1"
    with pytest.raises(StudyError, match="robots 'panda' and 'puma560' have other parameters"):
        _ = study_from(axes(content, field="robot", values=["panda", "puma560"]), "study").points
