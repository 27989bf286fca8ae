"""The attribution of Table 2 beside its simulation: no bit depends on which process computed what."""

import json
from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest

from idbench.experiments.paper import parallel_attribution
from idbench.experiments.paper.attribution import imperfections
from idbench.experiments.paper.parallel_attribution import ParallelAttribution, lines
from idbench.experiments.paper.table2 import Table2
from idbench.sim.drives import AveragedDrive
from idbench.sim.scenario.scenario_file import load, to_dict
from idbench.sim.trajectories import Quintic, RandomMoves

pytestmark = pytest.mark.thorough

NAMES = ("nothing", "hold, not given", "standstill, not masked")


@pytest.fixture
def short(monkeypatch):
    """Six moves, three of the imperfections."""
    points = RandomMoves(moves=6).plan(load("table2").nominal_robot)
    trajectory = Quintic(tuple(map(tuple, points.waypoints.tolist())), tuple(points.durations.tolist()), 3.0)
    scenario = replace(load("table2"), trajectory=trajectory, drive=AveragedDrive())
    monkeypatch.setattr(parallel_attribution, "imperfections", lambda s: [i for i in imperfections(s) if i.name in NAMES])
    return scenario


@pytest.fixture
def alone(short):
    """The errors without a second process."""
    return dict(json.loads(line) for line in lines(json.dumps(to_dict(short))))


def assert_same(found, expected):
    assert list(found) == list(expected) == list(NAMES)
    for name, errors in found.items():
        for form, error in errors.items():
            np.testing.assert_array_equal(error, expected[name][form])


def test_the_process_computes_what_this_one_would(short, alone, monkeypatch):
    beside = ParallelAttribution(short)
    monkeypatch.setattr(parallel_attribution, "errors_of", None)  # this one computes nothing
    while beside._reader.is_alive():
        beside._reader.join(1.0)
    assert_same(beside.errors(), alone)


def test_a_killed_process_takes_nothing_away(short, alone):
    beside = ParallelAttribution(short)
    beside.stop()
    seen = []
    assert_same(beside.errors(seen.append), alone)
    assert seen == sorted(seen)


def test_a_run_that_fails_ends_the_process(short, monkeypatch):
    def fail(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("idbench.experiments.paper.table2.simulate", fail)
    with pytest.raises(KeyboardInterrupt), closing(Table2(short)) as table:
        _ = table.run
    assert table._attribution._process.poll() is not None


def test_where_no_process_can_begin_this_one_does_it_all(short, alone, monkeypatch):
    monkeypatch.setattr(parallel_attribution.sys, "executable", "/nowhere/python")
    assert_same(ParallelAttribution(short).errors(), alone)
