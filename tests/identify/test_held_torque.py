"""Closed loops with a held torque and a known computing delay, exact encoder: known and not known to identification."""

from dataclasses import replace

import pytest

from idbench.identify import MODELS, OPERATORS, AsLogged, PowerModel, idbench_chain, identify, scara
from idbench.sim.engine.simulation import simulate
from idbench.sim.scenario.scenario import Timing
from idbench.sim.scenario.scenario_file import load

DELAYS = [0.0, 0.003, 0.0052, 0.007, 0.010, 0.013]


@pytest.fixture(scope="module", params=DELAYS)
def log(request):
    return simulate(replace(load("ideal"), timing=Timing(delay=request.param))).alone()


@pytest.mark.thorough
@pytest.mark.parametrize("model", MODELS.builtin)
def test_a_held_torque_that_says_so_is_identified(model, log, truth):
    """The remaining error is RK4 at 1 ms and MuJoCo's soft friction near standstill."""
    assert identify(log, scara(), MODELS.create(model)).relative_error_percent(truth).max() < 0.1


@pytest.mark.thorough
@pytest.mark.parametrize("operator", ["windows", "modulating"])
def test_so_it_is_by_the_energy_form_and_the_weak_form(operator, log, truth):
    chain = replace(idbench_chain(), operator=OPERATORS.create(operator))
    assert identify(log, scara(), PowerModel(), chain).relative_error_percent(truth).max() < 0.1


@pytest.mark.thorough
@pytest.mark.parametrize("model", MODELS.builtin)
def test_unaligned_it_shows_the_negative_friction_of_the_papers_table_2(model, log):
    unaligned = identify(log, scara(), MODELS.create(model), replace(idbench_chain(), alignment=AsLogged()))
    X = dict(zip(unaligned.names, unaligned.X, strict=True))
    assert X["Fv1"] < 0
    assert X["Fs1"] > 0.5
