"""What a loop commands against ripple, beside a twin without ripple."""

from dataclasses import replace

import numpy as np
import pytest

from idbench.sim import load_scenario
from idbench.sim.controllers import PID, ComputedTorque, PDFeedforward
from idbench.sim.drives import AveragedDrive, IdealDrive
from idbench.sim.engine.rejection import rejection
from idbench.sim.engine.simulation import simulate
from idbench.sim.scenario.measurement import Ripple
from idbench.sim.trajectories import RandomMoves


@pytest.fixture(scope="module")
def scenario():
    moves = RandomMoves(moves=4, durations=(1.2, 1.2), rest=0.3)
    return replace(load_scenario("ripple"), drive=AveragedDrive(), trajectory=moves)


SLOW = pytest.mark.thorough


@pytest.mark.parametrize(
    "controller",
    [
        PDFeedforward(),
        pytest.param(PDFeedforward(bandwidth=(6.0, 30.0)), marks=SLOW),
        pytest.param(PID(), marks=SLOW),
        pytest.param(ComputedTorque(), marks=SLOW),
    ],
)
def test_it_is_what_a_twin_without_ripple_does_not_command(scenario, controller):
    """While joints move: at rest friction holds what ripple would move, and the loop is linear about its motion otherwise."""
    with_it = replace(scenario, controller=controller)
    run, twin = simulate(with_it), simulate(replace(with_it, ripple=Ripple()))
    found, truth = rejection(run), (run.command - twin.command)[0]
    assert found is not None
    moving = (np.abs(run.qd[0]) > 0.5).all(axis=1)
    mine, theirs = found.rejected[moving], truth[moving]
    np.testing.assert_allclose(mine.std(axis=0), theirs.std(axis=0), rtol=0.1)
    assert min(np.corrcoef(mine[:, j], theirs[:, j])[0, 1] for j in range(2)) > 0.9
    assert "joint1" in found.words(run.robots[0].joints, with_it.wdyn)


@pytest.mark.thorough
def test_a_fast_loop_rejects_more(scenario):
    slow, fast = (rejection(simulate(replace(scenario, controller=PDFeedforward(bandwidth=(w,))))) for w in (4.0, 40.0))
    assert (fast.rejected.std(axis=0) > 1.5 * slow.rejected.std(axis=0)).all()


def test_without_ripple_there_is_nothing_to_reject(scenario):
    assert rejection(simulate(replace(scenario, ripple=Ripple(), drive=IdealDrive()))) is None
