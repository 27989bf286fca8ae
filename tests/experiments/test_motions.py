"""Table 1 over random motions: their class, which are kept, and what is counted."""

import json

import numpy as np
import pytest

from idbench.experiments.cli import main
from idbench.experiments.errors import ExperimentError
from idbench.experiments.paper.motions import COMPARED, Errors, Table1Motions, relations
from idbench.experiments.paper.table1 import PAPER, over_explicit
from idbench.identify import IirLowPass, ReversalMask
from idbench.identify.rows.chain import CHAINS
from idbench.sim.trajectories import RandomPace


@pytest.fixture(scope="module")
def few():
    return Table1Motions(60, seed=3, tolerance=0.6)


def test_motions_are_of_the_papers_class(robot):
    """40 s of fifth-order moves, each of whole samples and not shorter than the pace, inside the ranges."""
    for seed in range(20):
        pace = RandomPace(seed=seed)
        plan = pace.plan(robot)
        assert plan.durations.sum() == pytest.approx(40.0)
        assert plan.durations.min() >= pace.shortest - 1e-9
        np.testing.assert_allclose(plan.durations * 100, np.rint(plan.durations * 100), atol=1e-6)
        assert pace.moves[0] <= len(plan.durations) <= pace.moves[1]
        assert (np.abs(np.diff(plan.waypoints, axis=0)) >= pace.smallest_move).all()
        assert (plan.waypoints >= robot.ranges[:, 0] + pace.clearance - 1e-9).all()
        assert (plan.waypoints <= robot.ranges[:, 1] - pace.clearance + 1e-9).all()


def test_the_masked_chain_is_the_papers_but_for_its_mask():
    masked, paper = CHAINS.create("paper_masked"), CHAINS.create("paper")
    assert isinstance(masked.mask, ReversalMask)
    assert isinstance(masked.operator, IirLowPass)
    assert {**vars(masked), "mask": paper.mask} == vars(paper)


@pytest.mark.thorough
def test_kept_motions_have_the_papers_condition_numbers_and_reversals_make_the_friction(few):
    for chain in COMPARED:
        for model, column in PAPER.items():
            share = few.errors[chain].condition[model] / column.condition_number
            assert (np.abs(np.log(share)) <= np.log(1.6)).all()
    friction = [few.errors[chain].percentiles("explicit", 50)[[1, 2, 6, 7]] for chain in COMPARED]
    assert (friction[0] > 2 * friction[1]).all()


@pytest.mark.thorough
def test_a_motion_does_not_depend_on_how_many_are_drawn(few):
    more = Table1Motions(70, seed=3, tolerance=0.6)
    for chain in COMPARED:
        part = more.errors[chain].percent["power"][: few.errors[chain].kept]
        np.testing.assert_array_equal(part, few.errors[chain].percent["power"])


def test_the_papers_errors_count_to_the_digits_that_it_prints():
    """0.003 may be 0.0025 to 0.0035."""
    percent = np.tile(np.array(PAPER["explicit"].error) + 4e-4, (5, 1))
    assert Errors(5, {}, {"explicit": percent}).explained("explicit").all()
    assert not Errors(5, {}, {"explicit": percent + 4e-4}).explained("explicit").any()


@pytest.mark.thorough
def test_the_command_writes_and_prints_the_table(tmp_path, capsys):
    assert main(["table1", "--motions", "90", "--seed", "3", "--out", str(tmp_path / "out")]) == 0
    printed = capsys.readouterr().out
    assert "of the paper's errors lie inside the band" in printed
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert set(summary["chains"]) == set(COMPARED)
    assert "Over the explicit model's errors, those of implicit are 2.7 times or more" in printed
    assert summary["chains"]["paper"]["over_explicit"]["power"]["paper"] > 6


def test_what_no_motion_has_is_told():
    with pytest.raises(ExperimentError, match=r"none of \d motions has the paper's condition numbers"):
        _ = Table1Motions(2, tolerance=1e-6).errors


def test_relations_of_the_paper_are_those_that_it_prints():
    """Geometric means of the ratios of the printed errors, the implicit ones by hand."""
    found = over_explicit({model: column.error for model, column in PAPER.items()})
    assert found["implicit"] == pytest.approx(
        np.prod([1.05, 3.135, 1.375, 2.667, 5.143, 9.225, 2.042, 2.5]) ** (1 / 8), rel=1e-3
    )
    own = np.tile(PAPER["explicit"].error, (4, 1))
    percent = {"explicit": own, "implicit": own * np.array([[3.0], [2.0], [3.0], [0.5]]), "power": own * 7.0}
    of = relations(Errors(4, {}, percent))
    assert of["implicit"]["reached"] == 0.5
    assert of["implicit"]["all_larger"] == 0.75
    assert of["implicit"]["median"] == pytest.approx(2.5)
    assert of["power"] == pytest.approx({"paper": 6.888, "median": 7.0, "reached": 1.0, "all_larger": 1.0}, rel=1e-3)
