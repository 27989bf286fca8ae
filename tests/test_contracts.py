"""Every plug-in of every table keeps the contract of its point; a new one is tested by being listed."""

import pytest

from idbench.experiments.contracts.contract import Example
from idbench.experiments.contracts.contracts import CONTRACTS, found, keeps
from idbench.experiments.plugin_tables import TABLES
from idbench.identify import BLOCKS, CHAINS, MODELS, Basis, identify, scara
from idbench.identify.models import THREE

EVERY = [f"{table.point}/{name}" for table in TABLES for name in table.builtin]


@pytest.fixture(scope="module")
def example():
    return Example()


SIMULATING = {f"estimators/{name}" for name in ("IV", "DIDIM", "CLIE", "CLOE", "OE", "UKF")}


@pytest.mark.parametrize("name", [pytest.param(n, marks=[pytest.mark.thorough] * (n in SIMULATING)) for n in EVERY])
def test_it_keeps_its_contract(name, example):
    assert [f"{asked} {complaint}" for asked, complaint in keeps(*found(name), example) if complaint] == []


def test_every_point_has_a_contract():
    assert set(CONTRACTS) == {table.point for table in TABLES}
    assert all(clause.__doc__ for clauses in CONTRACTS.values() for clause in clauses)


@pytest.mark.thorough
@pytest.mark.parametrize("name", CHAINS.builtin)
@pytest.mark.parametrize("model", [*THREE, "energy"])
def test_chains_recover_ideal_data(name, model, log, truth):
    """To the largest error in the paper's Table 1 but for what only a small parameter shows: 10 %; chain idbench 0.001 %."""
    found = identify(log, scara(), MODELS.create(model), CHAINS.create(name))
    assert found.relative_error_percent(truth).max() < {"idbench": 0.001}.get(name, 10.0)


def test_a_robot_is_the_sum_of_its_blocks():
    blocks = [BLOCKS.create(name) for name in BLOCKS.builtin if name != "stribeck-free"]  # it has the names of stribeck
    basis = Basis(2, tuple(blocks))
    assert len(basis.names) == sum(len(block.parameters(2)) for block in blocks)
