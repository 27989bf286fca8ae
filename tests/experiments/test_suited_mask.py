"""Masks that reach farther, and the laws of slow motion that they hide."""

from dataclasses import replace

import numpy as np
import pytest

from idbench.experiments.identification.friction_choice import hidden_laws
from idbench.identify import BLOCKS, CHAINS, ExplicitModel, Problem, ReversalMask, scara
from idbench.identify.basis.of_joints import OfJoints
from idbench.sim.engine.simulation import simulate
from idbench.sim.scenario.scenario_file import load


@pytest.fixture(scope="module")
def log():
    return simulate(load("ideal")).alone()


def problem(log, law, speed, **shapes):
    block = BLOCKS.create(law).at({name: np.array([x, x]) for name, x in shapes.items()})
    chain = CHAINS.create("idbench")
    masked = replace(chain, mask=replace(chain.mask, threshold=(speed,)))
    assert isinstance(masked.mask, ReversalMask)
    return Problem((log,), scara() + OfJoints(block, (0,)), ExplicitModel(), masked)


def test_stribeck_friction_below_the_mask_is_dropped_and_above_it_is_not(log):
    for vs in (0.02, 0.005):  # from the latter nothing at all is left, not a smallest number
        assert set(hidden_laws(problem(log, "stribeck", 0.01, vs=vs), problem(log, "stribeck", 0.2, vs=vs))) == {"Fst1", "vs1"}
    assert hidden_laws(problem(log, "stribeck", 0.02, vs=0.2), problem(log, "stribeck", 0.2, vs=0.2)) == ()


def test_laws_of_all_speeds_stay_however_small_they_are(log):
    shape = {"exponent": 3.0}
    assert hidden_laws(problem(log, "power", 0.02, **shape), problem(log, "power", 0.2, **shape)) == ()
