"""The attribution of Table 2 beside its simulation: no bit depends on the threads, and an end of one ends the other."""

from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest

from idbench.experiments.paper import attribution
from idbench.experiments.paper.attribution import Attribution, imperfections
from idbench.experiments.paper.table2 import Table2
from idbench.sim.drives import AveragedDrive
from idbench.sim.scenario.scenario_file import load
from idbench.sim.trajectories import Quintic, RandomMoves

pytestmark = pytest.mark.thorough

NAMES = ("nothing", "hold, not given", "standstill, not masked")


@pytest.fixture
def short(monkeypatch):
    """Six moves, three of the imperfections."""
    points = RandomMoves(moves=6).plan(load("table2").nominal_robot)
    trajectory = Quintic(tuple(map(tuple, points.waypoints.tolist())), tuple(points.durations.tolist()), 3.0)
    scenario = replace(load("table2"), trajectory=trajectory, drive=AveragedDrive())
    monkeypatch.setattr(attribution, "imperfections", lambda s: [i for i in imperfections(s) if i.name in NAMES])
    return scenario


def test_no_bit_depends_on_the_threads(short):
    seen = []
    one, two = Attribution(short, 1).errors(seen.append), Attribution(short, 3).errors()
    assert list(one) == list(two) == list(NAMES)
    assert seen == sorted(seen)
    assert seen[-1] == 1
    for name, errors in one.items():
        for form, error in errors.items():
            np.testing.assert_array_equal(error, two[name][form])


def test_a_run_that_fails_ends_the_simulations_beside_it(short, monkeypatch):
    def fail(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("idbench.experiments.paper.table2.simulate", fail)
    with pytest.raises(KeyboardInterrupt), closing(Table2(short)) as table:
        _ = table.run
    assert all(future.done() for future in table._attribution._logs.values())
