"""Table 2 and its attribution: on short motions, to the bit on any number of threads; an end of one ends the other."""

from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest

from idbench.experiments.paper import attribution
from idbench.experiments.paper.attribution import Attribution, imperfections
from idbench.experiments.paper.table2 import PAPER, Table2
from idbench.sim.drives import AveragedDrive
from idbench.sim.scenario.scenario_file import load, to_toml
from idbench.sim.trajectories import Quintic, RandomMoves

NAMES = ("nothing", "hold, not given", "standstill, not masked")


@pytest.fixture
def short(monkeypatch):
    """Return what makes the table's scenario with an averaged drive, some moves and some of the imperfections."""

    def made(moves, names):
        points = RandomMoves(moves=moves).plan(load("table2").nominal_robot)
        trajectory = Quintic(tuple(map(tuple, points.waypoints.tolist())), tuple(points.durations.tolist()), 3.0)
        monkeypatch.setattr(attribution, "imperfections", lambda s: [i for i in imperfections(s) if i.name in names])
        return replace(load("table2"), trajectory=trajectory, drive=AveragedDrive())

    return made


@pytest.mark.thorough
def test_no_bit_depends_on_the_threads(short):
    seen, scenario = [], short(6, NAMES)
    one, two = Attribution(scenario, 1).errors(seen.append), Attribution(scenario, 3).errors()
    assert list(one) == list(two) == list(NAMES)
    assert seen == sorted(seen)
    assert seen[-1] == 1
    for name, errors in one.items():
        for form, error in errors.items():
            np.testing.assert_array_equal(error, two[name][form])


@pytest.mark.thorough
def test_a_run_that_fails_ends_the_simulations_beside_it(short, monkeypatch):
    def fail(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("idbench.experiments.paper.table2.simulate", fail)
    with pytest.raises(KeyboardInterrupt), closing(Table2(short(6, NAMES))) as table:
        _ = table.run
    assert all(future.done() for future in table._attribution._logs.values())


@pytest.mark.thorough
def test_it_is_printed_and_written(short, tmp_path, ran):
    """Its own robot, 12 moves: signature, rows, attribution."""
    (tmp_path / "twin.toml").write_text(to_toml(short(12, ("nothing", "hold, not given", "gain error of 2 %"))))
    printed, _, summary = ran("table2 --scenario twin.toml --out out")
    assert "explicit model, 2 realizations" in printed
    assert "gain error of 2 %" in printed
    paper, alone = summary["paper_processing"], summary["attribution_percent"]
    assert paper["explicit"]["rows"] == paper["implicit"]["rows"] == paper["power"]["rows"]
    for model in paper.values():
        assert model["estimate"][1] < 0  # Fv1
        assert model["estimate"][2] > 0.5  # Fs1
    np.testing.assert_allclose(paper["explicit"]["estimate"], paper["implicit"]["estimate"], rtol=0.05)
    np.testing.assert_allclose(alone["gain error of 2 %"]["explicit"], 2.0, atol=0.02)
    assert np.abs(alone["nothing"]["power"]).max() < 0.1
    assert alone["hold, not given"]["power"][1] < -100
    assert len(list((tmp_path / "out").glob("log*.parquet"))) == 4


def test_it_makes_the_papers_rows_on_the_motion_that_ships():
    """1600 rows each: two realizations of 800, four of 400; the scenario is checked before anything is simulated."""
    table = Table2(load("table2"))
    assert table.rest == 3.0
    assert sum(load("table1").trajectory.durations) == pytest.approx(40.0)
    assert {name: len(column.estimate) for name, column in PAPER.items()} == dict.fromkeys(PAPER, 8)
