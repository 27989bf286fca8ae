"""Verdicts on right and wrong models: they compare with the noise of the log, torque first, and name the likely cause."""

import re
from dataclasses import replace

import numpy as np
import pytest

from idbench.experiments.identification.fitting import fit
from idbench.experiments.identification.log_warnings import unchanging
from idbench.experiments.identification.logs import Logs
from idbench.experiments.identification.request import Request
from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.judgement.held_out import on_log
from idbench.experiments.judgement.remedies import delay_advice, remedies
from idbench.experiments.judgement.warnings import warnings_of_result
from idbench.experiments.requests.shared import Parameters
from idbench.identify import MotionLog
from idbench.identify.files.log_file import read_log
from idbench.identify.judge.delay import estimate_delay

PUMA = "puma560"


def level(log):
    return np.sqrt(np.mean(log.tau**2, axis=0))


def late(log, ms):
    return MotionLog(log.fs, log.q, log.tau, replace(log.torque, delay=log.torque.delay + 1e-3 * ms))


def torques(log, change):
    return MotionLog(log.fs, log.q, change(log.tau), log.torque)


@pytest.fixture
def pair(logs):
    return [read_log(logs / f"{name}.parquet") for name in ("first", "second")]


def validated(pair, asked=Parameters(), models=("explicit",)):  # noqa: B008  # frozen
    first, second = pair
    return on_log(fit(Request(RobotModel(PUMA, asked), models), Logs((first,))), "second", second)


def without(letters):
    names = RobotModel(PUMA).basis.names
    return Parameters(without=tuple(name for name in names if name.startswith(letters)))


@pytest.mark.thorough
def test_the_right_model_is_good_and_noise_explains_all_of_it(pair):
    verdict = validated(pair).verdicts["explicit"]
    assert verdict.word == "good"
    assert (verdict.validation.excess == 0).all()


def test_noise_of_the_log_is_no_fault_of_the_model(pair):
    """White noise of a tenth of each torque: 2 % of it passes the filter."""
    rng = np.random.default_rng(1)
    noisy = [torques(log, lambda tau: tau + 0.1 * level(log) * rng.standard_normal(tau.shape)) for log in pair]  # noqa: B023
    verdict = validated(noisy).verdicts["explicit"]
    assert verdict.validation.percent.max() > 1
    assert verdict.word == "good"
    assert any("noise and sigma explain all of it" in reason for reason in verdict.reasons)


@pytest.mark.thorough
@pytest.mark.parametrize("letters", ["F", "Ia"])
def test_models_without_friction_or_rotors_are_poor(pair, letters):
    verdict = validated(pair, without(letters)).verdicts["explicit"]
    assert verdict.word == "poor"
    assert verdict.validation.percent_of_level(verdict.validation.excess).max() > 10


@pytest.mark.thorough
def test_noise_that_could_hide_a_wrong_model_leaves_it_unsure(pair):
    rng = np.random.default_rng(1)
    loud = [torques(log, lambda tau: tau + 2 * level(log) * rng.standard_normal(tau.shape)) for log in pair]  # noqa: B023
    verdict = validated(loud).verdicts["explicit"]
    assert verdict.word == "unsure"
    assert "which could hide a wrong model" in " ".join(verdict.reasons)


@pytest.mark.thorough
def test_a_wrong_delay_is_named_by_the_log_itself(pair):
    """8 ms too late: small in the torque, not in friction. What is found does not depend on what was stated."""
    (found,) = delay_advice(validated([late(log, 8) for log in pair]).fit)
    assert "where 8.66 ms is assumed: --torque-delay estimate" in found
    assert re.search(r"the log shows a torque delay of 0\.6[56]\d* ms", found)
    stated = [estimate_delay([late(log, ms) for log in pair], RobotModel(PUMA).basis) for ms in (-3, 3)]
    assert abs(stated[0].delay - stated[1].delay) < 0.2 * stated[0].sigma  # steps end below a tenth of it
    assert abs(stated[0].delay - pair[0].torque.delay) < 3 * stated[0].sigma
    assert not list(delay_advice(validated(pair).fit))


@pytest.mark.thorough
def test_options_are_advised_that_help_and_by_how_much(pair):
    moved = [torques(log, lambda tau: tau + 0.2 * level(pair[0])) for log in pair]
    found = list(remedies(validated(moved)))
    assert [text.split()[1:3] for text in found] == [["--add", "offset"]]
    assert not list(remedies(validated(pair)))


@pytest.mark.parametrize("models", [("power", "explicit"), ("explicit", "power")])
def test_a_starved_power_model_is_told_to_be_so_where_it_leads_and_the_explicit_one_recommended(pair, models):
    """A third of a log: hardly more rows than parameters in the power model; the explicit one has six times as many."""
    part = pair[0].part(0, int(0.4 * pair[0].samples))
    found = fit(Request(RobotModel(PUMA), models), Logs((part,)))
    rows, p = int(found.estimates["power"].row_count), len(found.basis.names)
    assert p < rows < 4 * p
    warnings = [warning for warning in warnings_of_result(found)["the motion"] if "identifies too little" in warning]
    told = f"the power model identifies too little: {rows} rows for {p} parameters"
    assert [warning.startswith(told) for warning in warnings] == [True] * (models[0] == "power")
    assert not any("units" in warning for warning in warnings_of_result(found))


@pytest.mark.thorough
def test_a_dead_torque_column_is_named_and_the_others_are_judged(pair):
    dead = [torques(log, lambda tau: tau * [1, 0, 1, 1, 1, 1]) for log in pair]
    made = validated(dead)
    assert made.verdicts["explicit"].word == "fair"  # as none is good that shows a mistake
    assert [(cause.suspect.cause, cause.joint) for cause in made.fit.diagnosis] == [("missing_torque", "joint2")]
    assert np.nanmax(made.verdicts["explicit"].validation.percent) < 2
    assert unchanging(dead[0], made.fit.robot_model.tree) == ["the torque of joint2 never changes: is it logged?"]


@pytest.mark.thorough
def test_a_delay_beyond_the_first_range_is_found(pair):
    """Torques logged 80 ms late: the best delay of the first range lies at its end, and the search goes farther."""
    shifted = [torques(log, lambda tau: np.roll(tau, 20, axis=0)) for log in pair]
    (found,) = delay_advice(validated(shifted).fit)
    assert "the log shows a torque delay of -79" in found


@pytest.mark.thorough
def test_a_single_wild_sample_does_not_excuse_itself_by_the_sigma_it_makes(pair):
    def struck(tau):
        wild = tau.copy()
        wild[len(tau) // 3, 0] += 300 * np.abs(tau[:, 0]).max()
        return wild

    hit = [torques(pair[0], struck), pair[1]]
    assert validated(hit).verdicts["explicit"].word in {"fair", "unsure", "poor"}
